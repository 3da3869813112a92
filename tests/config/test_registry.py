"""What is installed: classes are checked when they are registered, one broken plugin harms no other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette import Array, Associator, ConfigError, MotionModel, PluginError, Registry, Sensor, Space, fields
from vedette.config.parameters import ROLES
from vedette.roles import CONTRACT, Component


@frozen
class Still(MotionModel):
    """Nothing moves.

    For tests.
    """

    kind: ClassVar[str] = "still"
    factor: float = fields.quantity("1", "without a default")
    sigma: float = fields.quantity("m", "standard deviation", above=0, default=2.0)

    @property
    def state(self) -> Space:
        return Space.of(x="m")

    def move(self, x: Array, dt: float) -> Array:
        return x

    def noise(self, x: Array, dt: float) -> Array:
        return np.eye(1)


@frozen
class AlsoStill(Still):
    """Takes the same name."""


@frozen
class Even(Associator):
    """All alike."""

    kind: ClassVar[str] = "still"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return np.full_like(scores, 1 / scores.shape[-1])


class Plain(Even):
    """Derived, but not made an attrs class itself."""


@frozen
class Half(MotionModel):
    """Lacks two methods."""

    kind: ClassVar[str] = "half"

    def noise(self, x: Array, dt: float) -> Array:
        return np.eye(1)


@frozen
class Nameless(Associator):
    """Has no kind."""

    associate = Even.associate


@frozen
class Homeless(Component):
    """Plays no role."""

    kind: ClassVar[str] = "homeless"


@frozen
class Unchecked(Even):
    """A parameter that takes whatever comes."""

    sigma: float = attrs.field()


@frozen
class Unresolved(Even):
    """An annotation that leads nowhere."""

    sigma: Nowhere = fields.quantity("m", "unknown")  # type: ignore[name-defined]  # noqa: F821


@frozen
class Buried(Even):
    """A part where a config cannot reach it."""

    sensors: list[Sensor] = fields.part("many")


@frozen
class Inner:
    """A table with a parameter that nothing checks."""

    depth: float = attrs.field()


@frozen
class Outer(Even):
    """Holds such a table."""

    inner: Inner | None = fields.part("a table", default=None)


@frozen
class KindTaken(Even):
    """Has a parameter where configs look for the kind."""

    kind_of_thing: float = attrs.field(alias="kind", converter=float)


def test_components_are_found_by_role_and_kind() -> None:
    registry = Registry.of(Even, Still)
    assert registry.get("motion", "still").cls is Still
    assert registry.get("associator", "still").cls is Even
    assert [(entry.role, entry.kind) for entry in registry] == [("motion", "still"), ("associator", "still")]
    assert registry.find("sensor", "still") is None


def test_a_listing_says_all_that_a_user_needs() -> None:
    (entry,) = Registry.of(Still)
    assert json.loads(json.dumps(entry.describe())) == {
        "role": "motion",
        "kind": "still",
        "distribution": "given here",
        "version": "",
        "summary": "Nothing moves.",
        "parameters": [
            {"name": "factor", "type": "number", "unit": "1", "doc": "without a default", "required": True},
            {
                "name": "sigma",
                "type": "number",
                "unit": "m",
                "doc": "standard deviation",
                "required": False,
                "default": 2.0,
                "limits": {"above": 0},
            },
        ],
    }


def test_a_role_added_later_needs_no_change(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PluginError, match=r"Homeless.*none of the roles"):
        Registry.of(Homeless)
    monkeypatch.setitem(ROLES, "home", Homeless)
    assert Registry.of(Homeless).get("home", "homeless").cls is Homeless


@pytest.mark.parametrize(
    ("classes", "message"),
    [
        ((Still, AlsoStill), r"motion kind 'still' is taken twice: .*Still\) and by .*AlsoStill\)"),
        ((Half,), "incomplete; a motion must also define move, state"),
        ((Plain,), "Plain.*not an attrs class"),
        ((Nameless,), "Nameless.*has no `kind"),
        ((Homeless,), "plays none of the roles motion, sensor"),
        ((Unchecked,), "sigma: nothing checks"),
        ((Unresolved,), "annotations cannot be resolved: .*Nowhere"),
        ((Buried,), r"sensors: a config cannot fill list\[.*use X"),
        ((Outer,), "Outer.*Inner: depth: nothing checks"),
        ((KindTaken,), "`kind` must be a ClassVar"),
        ((Even(),), "is not a class"),
        ((int,), "int.*plays none of the roles"),
    ],
)
def test_a_class_that_breaks_the_contract_is_refused_at_once(classes: tuple[Any, ...], message: str) -> None:
    with pytest.raises(PluginError, match=message):
        Registry.of(*classes)


def test_what_is_missing_is_told_with_what_there_is() -> None:
    registry = Registry.of(Still, Even)
    with pytest.raises(ConfigError, match=r"motion: unknown kind 'stil'; did you mean 'still'\? installed: still$"):
        registry.get("motion", "stil")
    with pytest.raises(ConfigError, match="sensor: unknown kind 'still'; it is a kind of motion and associator; none"):
        registry.get("sensor", "still")
    with pytest.raises(ConfigError, match="sensors: is not a role; did you mean 'sensor'"):
        registry.get("sensors", "radar")


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
        ("VEDETTE_CONTRACT = 1\n", "one-dist 1.0: vedette_test_one has no function `vedette_components`"),
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


def test_the_registry_is_a_value() -> None:
    assert Registry.of(Still, Even) == Registry.of(Even, Still)
    assert Registry.of(Still) != Registry.of(Even)
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        Registry.of(Still).entries = ()  # type: ignore[misc]


def test_everything_of_this_distribution_is_registered() -> None:
    registry = Registry.installed()
    assert [str(plugin) for plugin in registry.broken] == []
    brought = {entry.cls.__module__.partition(".")[0] for entry in registry if entry.distribution == "vedette"}
    roots = [Path(vedette.__file__).parents[1], *(Path(vedette.__file__).parents[2] / f for f in ("plugins", "simulators"))]
    packages = {folder.name for root in roots for folder in root.glob("vedette*") if (folder / "__init__.py").is_file()}
    assert brought == packages
