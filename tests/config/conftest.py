"""What is installed, and distributions made for a test that are installed beside it."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vedette import Registry
from vedette.config.plugins import installed_figures
from vedette_study.chunk import study_figures

Distribution = Callable[[str, str, str], Path]


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry.installed()


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Distribution]:
    """A folder on the import path that looks as if pip had installed distributions there from their pyproject.toml."""
    monkeypatch.syspath_prepend(str(tmp_path))
    _forget_figures()
    installed = []

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
        sys.modules.pop(module, None)
        installed.append(module)
        return tmp_path

    yield install
    for module in installed:  # another test may call its own so
        sys.modules.pop(module, None)
    _forget_figures()


def _forget_figures() -> None:
    """What is installed changes within a test, and only there: the figures of plugins are looked up once a process."""
    installed_figures.cache_clear()
    study_figures.cache_clear()
