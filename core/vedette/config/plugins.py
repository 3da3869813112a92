"""Load the plugins: one that keeps the contract is used; any other is set aside with its reason, harming none."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from warnings import warn

from attrs import field, frozen

from vedette.config.contract import Installed, check_version, described
from vedette.config.parameters import role_of
from vedette.errors import PluginError, VedetteError
from vedette.metrics.score import FIGURES, Figure
from vedette.roles import Component, Sensor
from vedette.tracking.intake import Intake
from vedette.types import Recording

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

GROUP = "vedette"
"""The entry point group, and the name of the pluggy project."""


@frozen
class Loaded:
    """A plugin that keeps the contract: its components, and its hooks."""

    distribution: str
    entry_point: str
    entries: tuple[Installed, ...]
    figures: tuple[Figure, ...]
    hooks: Any = field(repr=False, eq=False)

    def __str__(self) -> str:
        return f"plugin {self.entry_point!r} of {self.distribution}"


@frozen
class SetAside:
    """A plugin that is not used, and why; `kinds` are the roles and kinds that it would provide, None if unknown."""

    distribution: str
    entry_point: str
    error: str
    kinds: tuple[tuple[str, str], ...] | None = None

    def __str__(self) -> str:
        return f"plugin {self.entry_point!r} of {self.distribution} {self.error}"

    def brings(self, role: str, kind: str) -> bool:
        """Return whether it is known to provide this kind."""
        return self.kinds is not None and (role, kind) in self.kinds


def load_plugins() -> tuple[tuple[Loaded, ...], tuple[SetAside, ...]]:
    """Load what the entry points of the group `vedette` name: the plugins to use, and those set aside."""
    return _found(tuple((place, _changed_at(place)) for place in sys.path))


def _changed_at(place: str) -> int:
    """Return when a folder changed, as it does where something is installed; 0 if there is none."""
    try:
        return Path(place).stat().st_mtime_ns
    except (OSError, ValueError):
        return 0


@lru_cache(maxsize=1)
def _found(places: tuple[tuple[str, int], ...]) -> tuple[tuple[Loaded, ...], tuple[SetAside, ...]]:
    """Read what is installed, anew where the folders of `sys.path` changed: it takes longer than to build a tracker."""
    from importlib.metadata import entry_points

    points = tuple(entry_points(group=GROUP))
    return _loaded(points, tuple("" if point.dist is None else str(point.dist.locate_file("")) for point in points))


@lru_cache(maxsize=1)
def _loaded(points: tuple[EntryPoint, ...], places: tuple[str, ...]) -> tuple[tuple[Loaded, ...], tuple[SetAside, ...]]:
    """Load plugins once, while what is installed, and in which `places`, stays the same."""
    owners = {id(dist): _owner(dist) for dist in {id(point.dist): point.dist for point in points}.values()}
    in_order = sorted(points, key=lambda point: (owners[id(point.dist)], point.name))
    plugins = [_load(point, *owners[id(point.dist)]) for point in in_order]
    return tuple(one for one in plugins if isinstance(one, Loaded)), tuple(
        one for one in plugins if isinstance(one, SetAside)
    )


def _owner(dist: Distribution | None) -> tuple[str, str]:
    """Return name and version of a distribution."""
    if dist is None:
        return "an unnamed distribution", ""
    metadata = dist.metadata  # parsed anew each time that it is asked for
    return metadata["Name"], metadata["Version"]


def _load(point: EntryPoint, name: str, version: str) -> Loaded | SetAside:
    """Import one plugin, call its hook and check all its components; whatever goes wrong there is its reason."""
    owner = f"{name} {version}".strip()
    try:
        module = point.load()
    except (Exception, SystemExit) as error:
        return SetAside(owner, point.name, f"could not be imported: {_reason(error)}")
    kinds = None
    try:
        check_version(module)
        hooks = _hooks(module)
        classes = _components(hooks)
        kinds = _kinds(classes)
        entries = tuple(described(cls, name, version) for cls in classes)
        return Loaded(owner, point.name, entries, _figures(hooks), hooks)
    except PluginError as error:
        reason = str(error)
    except (Exception, SystemExit) as error:
        reason = f"it failed: {_reason(error)}"
    return SetAside(owner, point.name, f"is set aside: {reason}", _would_bring(module) if kinds is None else kinds)


def _reason(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _hooks(module: Any) -> Any:
    """Return the hooks of one plugin, which no other plugin answers; PluginError if they do not fit."""
    import pluggy

    from vedette.config import hooks

    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(hooks)
    try:
        manager.register(module)
        manager.check_pending()
    except pluggy.PluginValidationError as error:
        raise PluginError(f"its hook does not fit: {error}") from error
    if not manager.hook.vedette_components.get_hookimpls():
        raise PluginError("it has no function `vedette_components` marked with @vedette.plugin")
    return manager.hook


def _components(hooks: Any) -> list[type[Component]]:
    """Return the classes that the hook of a plugin provides, each once."""
    brought = hooks.vedette_components()
    if not brought:
        raise PluginError("its function `vedette_components` returns nothing")
    return list({id(cls): cls for classes in brought for cls in classes}.values())


def _figures(hooks: Any) -> tuple[Figure, ...]:
    """Return the figures that the hook of a plugin provides; PluginError for one that cannot be told or computed."""
    brought = tuple(figure for figures in hooks.vedette_figures() for figure in figures)
    taken = {figure.name for figure in FIGURES} | {figure.study for figure in FIGURES if figure.study}
    for figure in brought:
        if not isinstance(figure, Figure) or figure.start is None:
            raise PluginError(f"its figures must be vedette.metrics.Figure with a start, got {figure!r}")
        if clash := taken & {figure.name, figure.study}:
            raise PluginError(f"figure {figure.name!r}: there is one of the name {clash.pop()!r} already")
        taken |= {figure.name} | ({figure.study} if figure.study else set())
    return brought


@cache
def installed_figures() -> tuple[Figure, ...]:
    """Return the figures of all plugins; of those of one name, the first."""
    brought = {figure.name: figure for plugin in reversed(load_plugins()[0]) for figure in reversed(plugin.figures)}
    return tuple(reversed(brought.values()))


def _kinds(classes: Iterable[Any]) -> tuple[tuple[str, str], ...]:
    """Return roles and kinds of classes, as far as they state them."""
    said = [(role_of(cls), getattr(cls, "kind", None)) for cls in classes if isinstance(cls, type)]
    return tuple((role, kind) for role, kind in said if role is not None and isinstance(kind, str))


def _would_bring(module: Any) -> tuple[tuple[str, str], ...] | None:
    """Return the roles and kinds of a plugin of another contract, None if its hook does not say."""
    try:
        return _kinds(_components(_hooks(module)))
    except (Exception, SystemExit):
        return None


def answers(hook: str, places: Iterable[str | Path], **given: Any) -> Iterator[tuple[Loaded, Any]]:
    """Yield each plugin that implements a hook, with what it returns for what is `given`; warn of one that fails.

    What goes wrong at a file is not the plugin's fault where a disk is full, or if it is beside one of `places` or below.
    """
    for used in load_plugins()[0]:
        try:
            said = getattr(used.hooks, hook)(**given)
        except VedetteError:  # of what was given, not of the plugin
            raise
        except (Exception, SystemExit) as error:
            if isinstance(error, OSError) and _is_at(error, places):
                raise
            warn(f"{used}: its {hook} failed: {_reason(error)}", RuntimeWarning, stacklevel=2)
            continue
        for answer in said:
            yield used, answer


def _is_at(error: OSError, places: Iterable[str | Path]) -> bool:
    """Return whether an error is of no file, as where a disk is full, or of one beside `places` or below."""
    if error.filename is None:
        return not isinstance(error, ConnectionError | TimeoutError)
    return any(Path(place).absolute().parent in Path(error.filename).absolute().parents for place in places)


def warnings_of(intake: Intake, recording: Recording, sensors: Mapping[str, Sensor]) -> Iterator[str]:
    """Yield what looks wrong with the input of a run, in the words of each plugin that judges it; one that fails is told."""
    for used in load_plugins()[0]:
        try:
            for sentences in used.hooks.vedette_warnings(intake=intake, recording=recording, sensors=sensors):
                yield from sentences
        except Exception as error:
            yield f"{used}: its vedette_warnings failed: {_reason(error)}"


def draft_of(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Return the config, as TOML, that a plugin drafts for data that it reads, with what the user `wishes`; else None."""
    drafts: Iterator[str] = (text for _, text in answers("vedette_draft", [path], path=path, wishes=wishes))
    return next(drafts, None)
