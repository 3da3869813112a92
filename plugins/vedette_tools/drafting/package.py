"""A package for a plugin: a component of one role that keeps its laws, the test that says so, and how it is installed.

The files stand in `templates`, with the plugin's own names left open.
"""

from __future__ import annotations

import keyword
import re
from importlib.resources import files
from pathlib import Path
from string import Template

from vedette.errors import ConfigError, Problem

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


def distribution_name(name: str) -> str:
    """Return what the package of a plugin called `name` is installed as; ConfigError for a name that is none."""
    return f"vedette-{_short(name).replace('_', '-')}"


def draft_package(name: str, folder: Path, role: str = "motion") -> list[Path]:
    """Write the package of a plugin called `name` into `folder`, which must not exist or be empty; return its files.

    `role` says what its component is. ConfigError for a name that is none, or a folder that holds anything.
    """
    short = _short(name)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError([Problem("--out", f"{str(folder)!r} exists already and is not an empty folder")])
    if role not in USES:
        raise ConfigError([Problem("--role", f"must be one of {', '.join(ROLES)}, got {role!r}")])
    title = "".join(word.capitalize() for word in short.split("_")) + role.capitalize()
    names = {"short": short, "module": f"vedette_{short}", "dashed": distribution_name(name), "title": title, "role": role}
    names["use"] = Template(USES[role]).substitute(names)
    templates, written = files("vedette_tools.drafting") / "templates", []
    for template, place in PLACES.items():
        text = (templates / template.format(**names)).read_text(encoding="utf-8")
        path = folder / place.format(**names)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(Template(text).substitute(names), encoding="utf-8", newline="\n")
        written.append(path)
    return written


def _short(name: str) -> str:
    """Return a plugin's name as a Python word; ConfigError for a name that is none."""
    short = re.sub(r"[-\s]+", "_", name.strip().lower()).removeprefix("vedette_")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", short) or keyword.iskeyword(short):
        right = "must be a word of letters, digits and hyphens that begins with a letter and is no keyword of Python"
        raise ConfigError([Problem("NAME", f"{right}, got {name!r}")])
    return short
