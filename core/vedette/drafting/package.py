"""A package for a plugin: a motion model that keeps its laws, the test that says so, and how it is installed."""

from __future__ import annotations

import keyword
import re
from pathlib import Path

from vedette.errors import ConfigError, Problem

FILES = {
    "pyproject.toml": """build-system = {{ requires = ["hatchling"], build-backend = "hatchling.build" }}

[project]
name = "{dashed}"
version = "0.1.0"
dependencies = ["vedette"]
entry-points.vedette.{short} = "{module}"

[project.optional-dependencies]
test = ["vedette[testing]"]
""",
    "README.md": """# {dashed}

Components for Vedette. Install it where Vedette is, and test it:

    pip install -e '.[test]'
    python -m pytest
    vedette components {short}_motion

A config may then say `motion = {{ kind = "{short}_motion", sigma_accel = 0.5 }}`. docs/write-a-plugin.md of Vedette shows
sensors, associators, estimators, births and lifecycles.
""",
    "src/{module}/__init__.py": '''"""What this package brings to Vedette."""

import vedette
from {module}.motion import {title}Motion

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components():
    """Return every component of this package."""
    return [{title}Motion]
''',
    "src/{module}/motion.py": '''"""How a target moves: replace this by your own model, and keep its laws."""

import numpy as np
from attrs import frozen

import vedette


@frozen
class {title}Motion(vedette.MotionModel):
    """White-noise acceleration: x' = x + T v, v' = v, with Q = sigma_accel^2 [T^3/3 T^2/2; T^2/2 T] per axis."""

    kind = "{short}_motion"
    linear = True
    divisible = True  # two steps give the moments of one of both lengths
    sigma_accel: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s", above=0)
    state = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")

    def move(self, x, dt):
        """Return the state `dt` s later: (*b, 4) -> (*b, 4)."""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x, dt):
        """Return F (4, 4)."""
        return np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))

    def noise(self, x, dt):
        """Return Q (4, 4)."""
        return self.sigma_accel**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))
''',
    "tests/test_components.py": '''"""Every component keeps the laws of its role; a failure says which, and on what."""

from {module}.motion import {title}Motion

from vedette.testing import conformance

Test{title}Motion = conformance({title}Motion)
''',
}
"""The files of a package, their names and texts with the plugin's own names left open."""


def distribution_name(name: str) -> str:
    """Return what the package of a plugin called `name` is installed as; ConfigError for a name that is none."""
    return f"vedette-{_short(name).replace('_', '-')}"


def draft_package(name: str, folder: Path) -> list[Path]:
    """Write the package of a plugin called `name` into `folder`, which must not exist or be empty; return its files.

    ConfigError for a name that is none, or a folder that holds anything.
    """
    short = _short(name)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError([Problem("--out", f"{str(folder)!r} exists already and is not an empty folder")])
    title = "".join(word.capitalize() for word in short.split("_"))
    names = {"short": short, "module": f"vedette_{short}", "dashed": distribution_name(name), "title": title}
    written = []
    for place, text in FILES.items():
        path = folder / place.format(**names)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.format(**names), encoding="utf-8", newline="\n")
        written.append(path)
    return written


def _short(name: str) -> str:
    """Return a plugin's name as a Python word; ConfigError for a name that is none."""
    short = re.sub(r"[-\s]+", "_", name.strip().lower()).removeprefix("vedette_")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", short) or keyword.iskeyword(short):
        right = "must be a word of letters, digits and hyphens that begins with a letter and is no keyword of Python"
        raise ConfigError([Problem("NAME", f"{right}, got {name!r}")])
    return short
