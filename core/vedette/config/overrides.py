"""Changes to a config from outside, before it is built: pairs of path and value, or `path.to.key=value` as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import reduce
from typing import Any

from attrs import frozen

from vedette.config.builder import LONGEST, told
from vedette.config.registry import Registry
from vedette.config.suggestions import did_you_mean, nearest
from vedette.config.texts import toml
from vedette.errors import ConfigError, Problem
from vedette.tracking.components import below

_STEP = re.compile(r'(?:^|\.)(?:(?P<name>[A-Za-z0-9_-]+)|(?P<quote>["\x27])(?P<quoted>.*?)(?P=quote))|\[(?P<index>\d+)\]')

KeyPath = tuple[str | int, ...]


def apply_overrides(config: Mapping[str, Any], overrides: Iterable[str], registry: Registry | None = None) -> dict[str, Any]:
    """Return the config with each `path.to.key=value` or `path.to.list[0].key=value` set, in order; the given one stays.

    A value is read as in TOML, and a bare word as a string. ConfigError reports every override that cannot be applied.
    """
    split, problems = [], []
    for override in overrides:
        place = f"--set {override}"[:LONGEST]
        path, rest = _leading_path(override)
        try:
            if not path or not rest.startswith("="):
                raise ValueError("must be written path.to.key=value, with [0] for the first of a list")
            split.append((place, path, _value(rest[1:].strip())))
        except ValueError as error:
            problems.append(Problem(place, str(error)))
    return _changed(config, split, problems, registry)


def apply_changes(
    config: Mapping[str, Any], changes: Iterable[tuple[str, Any]], registry: Registry | None = None
) -> dict[str, Any]:
    """Return the config with each (path, value) set, in order; the given one stays. A value is used as it is.

    A missing table on the way is created. A new `kind` drops the parameters that the old kind took and the new one does not,
    but none that an earlier change has set by its name. ConfigError reports every change that cannot be made, at its path.
    """
    split, problems = [], []
    for written, value in changes:
        path, rest = _leading_path(written)
        if path and not rest:
            split.append((written[:LONGEST], path, value))
        else:
            problems.append(Problem(written[:LONGEST], "must be a path.to.key, with [0] for the first of a list"))
    return _changed(config, split, problems, registry)


def path_of(written: str) -> KeyPath:
    """Return the path that a change or an override names; () if it names none."""
    return _leading_path(written)[0]


def _changed(
    config: Mapping[str, Any],
    changes: Iterable[tuple[str, KeyPath, Any]],
    problems: list[Problem],
    registry: Registry | None,
) -> dict[str, Any]:
    """Return the config with each change made; ConfigError with all problems at their places."""
    registry = Registry.installed() if registry is None else registry
    changed: Any = dict(config)
    done: list[KeyPath] = []
    for told_at, path, value in changes:
        try:
            beside = {p[len(path) - 1] for p in done if p[: len(path) - 1] == path[:-1] and len(p) >= len(path)}
            changed = _Change(path, value, registry, frozenset(beside)).of(changed, 0)
            done.append(path)
        except ValueError as error:
            problems.append(Problem(told_at, str(error)))
    if problems:
        raise ConfigError(problems)
    return dict(changed)


@frozen
class _Change:
    """One override; `kept` are the names in its table that earlier overrides have set."""

    path: KeyPath
    value: Any
    registry: Registry
    kept: frozenset[str | int]

    def of(self, given: Any, depth: int) -> Any:
        """Return `given`, which is `depth` steps down the path, with the change inside; ValueError if that is wrong."""
        if depth == len(self.path):
            return self.value
        step = self.path[depth]
        if isinstance(step, int):
            return self._in_list(given, step, depth)
        if not isinstance(given, Mapping):
            raise ValueError(f"{self._place(depth)} is {told(given)}, so there is no {step!r} in it")
        if step not in given:
            self._check_new(given, step, depth)
        if step == "kind" and depth == len(self.path) - 1 and isinstance(self.value, str):
            given = self._fit(given, self.value)
        return {**given, step: self.of(given.get(step, {}), depth + 1)}

    def _in_list(self, given: Any, index: int, depth: int) -> list[Any]:
        if not isinstance(given, list | tuple):
            raise ValueError(f"{self._place(depth)} is {told(given)}, not a list: there is no [{index}] in it")
        if index >= len(given):
            last = f"[0] to [{len(given) - 1}]" if given else "nothing"
            raise ValueError(f"{self._place(depth)} has {last}, there is no [{index}] in it")
        return [*given[:index], self.of(given[index], depth + 1), *given[index + 1 :]]

    def _check_new(self, given: Mapping[str, Any], step: str, depth: int) -> None:
        """Refuse to create a table if its name looks like a typing error. A `kind` may create it."""
        ahead = self.path[depth + 1 :]
        if ahead and isinstance(ahead[0], int):
            raise ValueError(f"there is no list {self._place(depth + 1)};{did_you_mean(step, given)}".rstrip(";"))
        if depth and ahead and (dotted := next((name for name in given if str(name).startswith(f"{step}.")), None)):
            raise ValueError(f"names that hold dots are quoted: {below(self._place(depth), dotted)}")
        if ahead and ahead != ("kind",) and nearest(step, given):
            raise ValueError(f"there is no {self._place(depth + 1)};{did_you_mean(step, given)}")

    def _fit(self, table: Mapping[str, Any], kind: str) -> Mapping[str, Any]:
        """Return the table without the parameters that its old kind takes and the new one does not."""
        old = [entry for entry in self.registry if entry.kind == table.get("kind")]
        roles = [entry.role for entry in old]
        new = [entry for entry in self.registry if entry.kind == kind and (entry.role in roles or not roles)]
        if not new:
            return table
        taken = {parameter.name for entry in new for parameter in entry.parameters} | self.kept
        lost = {parameter.name for entry in old for parameter in entry.parameters} - taken
        return {name: value for name, value in table.items() if name not in lost}

    def _place(self, depth: int) -> str:
        return reduce(below, self.path[:depth], "") or "the config"


def _leading_path(written: str) -> tuple[KeyPath, str]:
    """Return the path that a text begins with, and the rest of the text."""
    path: list[str | int] = []
    rest = written.strip()
    end = 0
    while step := _STEP.match(rest, end):
        path.append(int(step["index"]) if step["index"] else step["name"] or step["quoted"])
        end = step.end()
    return tuple(path), rest[end:].lstrip()


def _value(text: str) -> Any:
    try:
        document = toml(f"value = {text}")
    except (ValueError, RecursionError) as error:
        if text[:1] in ("[", "{", '"', "'"):
            raise ValueError(f"the value is not well-formed TOML: {error}") from None
        return text
    value = document["value"]
    return value if len(document) == 1 and isinstance(value, bool | int | float | str | list | dict) else text
