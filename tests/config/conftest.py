"""What is installed, and distributions made for a test that are installed beside it."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from vedette import Registry
from vedette.roles import CONTRACT

Distribution = Callable[[str, str, str], Path]

PLUGIN = '''
from typing import ClassVar
import numpy as np
from attrs import frozen
import vedette
from vedette import fields

VEDETTE_CONTRACT = {contract}

@frozen
class {name}(vedette.MotionModel):
    """Drifts with the current.

    By a third party.
    """

    kind: ClassVar[str] = "{kind}"
    current: float = fields.quantity("m/s", "speed of the water", at_least=0)

    @property
    def state(self) -> vedette.Space:
        return vedette.Space.of(x="m", y="m")

    def move(self, x, dt):
        return x + self.current * dt

    def noise(self, x, dt):
        return dt * np.eye(2)

@vedette.plugin
def vedette_components():
    return [{name}]
'''


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry.installed()


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Distribution:
    """A folder on the import path that looks as if pip had installed distributions there from their pyproject.toml."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def install(name: str, module: str, source: str) -> Path:
        project = f'[project]\nname = "{name}"\nversion = "1.0"\n[project.entry-points.vedette]\nmain = "{module}"\n'
        points = tomllib.loads(project)["project"]["entry-points"]["vedette"]
        (tmp_path / f"{module}.py").write_text(source)
        info = tmp_path / f"{name.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        (info / "pyproject.toml").write_text(project)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"{key} = {value}" for key, value in points.items()]
        (info / "entry_points.txt").write_text("\n".join(["[vedette]", *lines, ""]))
        monkeypatch.delitem(sys.modules, module, raising=False)
        return tmp_path

    return install


@pytest.fixture
def drifting() -> Callable[..., str]:
    """The source of a plugin that brings one motion model."""

    def source(name: str = "Drift", kind: str = "drift", contract: int = CONTRACT) -> str:
        return PLUGIN.format(name=name, kind=kind, contract=contract)

    return source
