"""One broken plugin harms no other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from vedette import ConfigError, PluginError, Registry
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


def drifting(name: str = "Drift", kind: str = "drift", contract: int = CONTRACT) -> str:
    return PLUGIN.format(name=name, kind=kind, contract=contract)


def test_a_broken_plugin_harms_no_other_and_is_told_when_something_is_missing(distribution: Distribution) -> None:
    distribution("foo-dist", "vedette_test_broken", "import a_library_that_is_not_there\n")
    distribution("quit-dist", "vedette_test_quits", "raise SystemExit(3)\n")
    distribution("bad-hook", "vedette_test_hook", "import vedette\n@vedette.plugin\ndef vedette_components(): 1 / 0\n")
    distribution("drift-dist", "vedette_test_drift", drifting())
    registry = Registry.installed()
    assert registry.get("motion", "constant_velocity").distribution == "vedette"
    assert registry.get("motion", "drift").distribution == "drift-dist"
    with pytest.raises(ConfigError) as caught:
        registry.get("motion", "tide")
    told = str(caught.value)
    assert "plugin 'main' of foo-dist 1.0 could not be imported: ModuleNotFoundError" in told
    assert "plugin 'main' of quit-dist 1.0 could not be imported: SystemExit: 3" in told
    assert "plugin 'main' of bad-hook 1.0 could not be imported: ZeroDivisionError" in told


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (drifting(kind="constant_velocity"), "'constant_velocity' is taken twice: by one-dist 1.0 .* and by vedette "),
        (drifting(contract=CONTRACT + 1), f"one-dist 1.0: is written for version {CONTRACT + 1} of the contract"),
        ("VEDETTE_CONTRACT = 2\n", "one-dist 1.0: vedette_test_one has no function `vedette_components`"),
        ("import vedette\n@vedette.plugin\ndef vedette_components(config): return []\n", "its hook does not fit"),
        (drifting().replace("def move", "def moves"), "Drift of one-dist 1.0: is incomplete; .* define move$"),
    ],
)
def test_a_plugin_that_breaks_the_contract_is_named(distribution: Distribution, source: str, message: str) -> None:
    distribution("one-dist", "vedette_test_one", source)
    with pytest.raises(PluginError, match=message):
        Registry.installed()


def test_two_third_parties_that_take_one_kind_are_both_named(distribution: Distribution) -> None:
    distribution("one-dist", "vedette_test_one", drifting("One"))
    distribution("other-dist", "vedette_test_other", drifting("Other"))
    with pytest.raises(PluginError, match=r"one-dist 1.0 \(vedette_test_one.One\) and by other-dist 1.0 \(vedette_test_oth"):
        Registry.installed()


USES_IT = """
import json, sys, vedette
tracker = vedette.build(json.loads(sys.argv[1]))
entry = vedette.Registry.installed().get("motion", "drift")
print(json.dumps([vedette.to_config(tracker), entry.describe()]))
"""


def test_a_third_partys_motion_model_works_in_a_config_of_another_process(distribution: Distribution) -> None:
    folder = distribution("drift-dist", "vedette_test_drift", drifting())
    distribution("foo-dist", "vedette_test_broken", "raise RuntimeError('half installed')\n")
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "drift", "current": "2 kn"}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "nearest"},
        "lifecycle": {"kind": "m_of_n"},
    }
    paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    run = subprocess.run(
        [sys.executable, "-c", USES_IT, json.dumps(config)],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    built, entry = json.loads(run.stdout)
    assert built["estimator"]["motion"] == {"kind": "drift", "current": pytest.approx(2 * 1852 / 3600)}
    assert (entry["distribution"], entry["version"], entry["summary"]) == ("drift-dist", "1.0", "Drifts with the current.")
    assert entry["parameters"][0]["unit"] == "m/s"
