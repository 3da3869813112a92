"""A package for a plugin: a component of one role that keeps its laws, the test that says so, and how it is installed.

The files stand in `templates`, with the plugin's own names left open.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from string import Template

from vedette.errors import ConfigError
from vedette_files.writing import write_text

USES = {
    "motion": 'motion = { kind = "${short}_motion", sigma_accel = 0.5 }',
    "sensor": 'sensors.radar = { kind = "${short}_sensor", sigma_range = 5, sigma_bearing = "0.5 deg" }',
    "associator": 'associator = { kind = "${short}_associator" }',
    "estimator": 'estimator = { kind = "${short}_estimator", motion = { kind = "constant_velocity", sigma_accel = 0.5 } }',
    "birth": 'birth = { kind = "${short}_birth", speed = 10 }',
    "lifecycle": 'lifecycle = { kind = "${short}_lifecycle", hits = 3, patience = 10 }',
}
"""The roles of which a package can be drafted, and how a config uses its component."""

ROLES = tuple(USES)

PLACES = {
    "pyproject.toml.txt": "pyproject.toml",
    "README.md.txt": "README.md",
    "init.py.txt": "src/{module}/__init__.py",
    "{role}.py.txt": "src/{module}/{role}.py",
    "test_components.py.txt": "tests/test_components.py",
}
"""The templates and where each goes."""

MORE = {"{role}.py.txt": "src/{module}/{role}.py", "test_components.py.txt": "tests/test_{role}.py"}
"""What one more component brings to a package of the same name."""


def distribution_name(name: str) -> str:
    """Return what the package of a plugin called `name` is installed as; ConfigError for a name that is none."""
    return f"vedette-{_short(name).replace('_', '-')}"


def draft_package(name: str, folder: Path, role: str = "motion") -> list[Path]:
    """Write the package of a plugin called `name` into `folder`, or add a component to that there; return what was written.

    `role` says what the component is. ConfigError for a name that is none, or a folder that holds anything else.
    """
    short = _short(name)
    if role not in USES:
        raise ConfigError.at("--role", f"must be one of {', '.join(ROLES)}, got {role!r}")
    title = "".join(word.capitalize() for word in short.split("_")) + role.capitalize()
    names = {"short": short, "module": f"vedette_{short}", "dashed": distribution_name(name), "title": title, "role": role}
    names["use"] = Template(USES[role]).substitute(names)
    init, listed, places = folder / "src" / names["module"] / "__init__.py", "", PLACES
    if init.is_file():
        listed, places = _listed(init, names), MORE
    elif folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError.at("--out", f"{str(folder)!r} exists already and is not an empty folder")
    templates = files("vedette_tools.drafting") / "templates"
    written = {folder / place.format(**names): template.format(**names) for template, place in places.items()}
    if there := [path for path in written if path.exists()]:
        raise ConfigError.at("--role", f"{str(there[0])!r} exists already: delete it, or choose another role")
    with _all_or_none(written):
        for path, template in written.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            text = (templates / template).read_text(encoding="utf-8")
            write_text(path, Template(text).substitute(names))
        if listed:
            write_text(init, listed)
    return [*written, *([init] if listed else [])]


@contextmanager
def _all_or_none(paths: Iterable[Path]) -> Iterator[None]:
    """Let files be written that are not there yet; unless all are, nothing is left of them and of folders made for them."""
    made = {folder for path in paths for folder in path.parents if not folder.exists()}
    try:
        yield
    except BaseException:
        for path in paths:
            path.unlink(missing_ok=True)
        for folder in sorted(made, reverse=True):
            with suppress(OSError):  # it was not made, or another process wrote into it
                folder.rmdir()
        raise


def _listed(init: Path, names: Mapping[str, str]) -> str:
    """Return the text of a package's `__init__.py` that lists one more component; ConfigError where it lists none."""
    text, line = init.read_text(encoding="utf-8"), "from {module}.{role} import {title}\n".format(**names)
    *_, last = [None, *re.finditer(r"^(import vedette|from vedette_[^(\n]*)\n", text, re.MULTILINE)]
    end = re.search(r"\breturn \[[^\]]*?\w(?=,?\s*\])", text)
    if last is None or end is None:
        right = f"must import vedette and `return [...]` its components, to add {names['title']} to them"
        raise ConfigError.at(str(init), right)
    return text[: last.end()] + line + text[last.end() : end.end()] + f", {names['title']}" + text[end.end() :]


def _short(name: str) -> str:
    """Return a plugin's name as a Python word; ConfigError for a name that is none."""
    short = re.sub(r"[-\s]+", "_", name.strip().lower()).removeprefix("vedette_")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", short) or keyword.iskeyword(short):
        right = "must be a word of letters, digits and hyphens that begins with a letter and is no keyword of Python"
        raise ConfigError.at("NAME", f"{right}, got {name!r}")
    return short
