"""Configs are walked together with the classes: built, written back, and judged with every problem at its path."""

from __future__ import annotations

import copy
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest
from attrs import frozen
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable

import vedette
from vedette import Array, Associator, ConfigError, Estimator, Registry, Sensor, fields
from vedette.config import build, load, to_config
from vedette.config.parameters import parameters, plain
from vedette.config.registry import Installed
from vedette.config.walker import Walker
from vedette.testing.judging import Misuse
from vedette.testing.strategies import components


@frozen
class Rate:
    """A table inside a table."""

    per_scan: float = fields.quantity("1", "how many", at_least=0)


@frozen
class Region:
    """A plain table."""

    width: float = fields.quantity("m", "east to west", above=0)
    corners: Array | None = fields.array("m", "a matrix", ndim=2, default=None)
    rates: dict[str, Rate] = fields.part("a table of tables", default=attrs.Factory(dict))


def _lower(instance: Any, attribute: attrs.Attribute[Any], value: float) -> None:
    if value > instance.high:
        raise ValueError(f"low: must be at most high, got {value:g} > {instance.high:g}")


@frozen
class Band(Associator):
    """Every shape that a parameter can have, and a rule across two of them."""

    kind: ClassVar[str] = "band"

    low: float = attrs.field(converter=float, validator=_lower)
    high: float = fields.quantity("1", "upper end")
    region: Region | None = fields.part("optional table", default=None)
    inner: Associator | None = fields.part("optional component", default=None)
    several: tuple[Associator, ...] = fields.part("list of components", default=())
    named: Mapping[str, Associator] = fields.part("table of components", default=attrs.Factory(dict))
    _hidden: int = fields.integer("a private name", default=3)
    words: tuple[str, ...] = fields.words("a list", default=())

    def __attrs_post_init__(self) -> None:
        if len(self.several) > 2:
            raise ValueError(f"several[2]: must be two at most, got {len(self.several)}")
        if self._hidden > 100:
            raise ValueError(f"_hidden: must be 100 at most, got {self._hidden}")
        if self.high > 1000:
            raise ValueError("the band is too high as a whole")

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return scores


SMALL = Registry.of(Band)
LEAST = {"kind": "band", "low": 1, "high": 2}


def walk(config: Mapping[str, Any], registry: Registry = SMALL) -> Any:
    """The band of a config, or the problems' lines."""
    walker, own = Walker(registry), parameters(Band)
    meant = walker.check_names(config, ["kind", *(parameter.name for parameter in own)], "", "band")
    built = walker.construct(Band, own, config, "", meant)
    return [str(problem) for problem in walker.problems] or built


def tracker_config() -> dict[str, Any]:
    return {
        "estimator": {
            "kind": "imm",
            "modes": [
                {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
                {"kind": "ukf", "motion": {"kind": "coordinated_turn", "sigma_accel": "0.02 g", "sigma_turn_rate": 0.01}},
            ],
            "transition": [[0.95, 0.05], [0.05, 0.95]],
            "absent": {"turn_rate": [0.0, 0.01]},
        },
        "sensors": {
            "radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": "0.5 deg", "max_range": "10 NM"},
            "lidar": {"kind": "cartesian_position", "sigma": 1},
        },
        "gate": {"probability": 0.95, "clutter": "nonparametric"},
        "associator": {"kind": "pda"},
        "lifecycle": {"kind": "m_of_n", "spread": {"vx": 10, "vy": 10, "turn_rate": 0.01}},
    }


def experiment_config() -> dict[str, Any]:
    return {**tracker_config(), "title": "two sensors", "seed": 7, "judge": {"cover_radius": 30}}


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry.installed()


def test_a_config_builds_what_its_author_would_write_in_python(registry: Registry) -> None:
    from vedette_standard.associators.pda import Pda
    from vedette_standard.estimators.kalman import Kalman
    from vedette_standard.lifecycles.m_of_n import MOfN
    from vedette_standard.motion.constant_velocity import ConstantVelocity
    from vedette_standard.sensors.cartesian_position import CartesianPosition

    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 2}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": "0.5 km"}},
        "associator": {"kind": "pda"},
        "lifecycle": {"kind": "m_of_n", "spread": {"vx": 10.0, "vy": 10.0}},
    }
    by_hand = vedette.Tracker(
        estimator=Kalman(ConstantVelocity(2.0)),
        sensors={"radar": CartesianPosition(500.0)},
        associator=Pda(),
        lifecycle=MOfN(spread={"vx": 10.0, "vy": 10.0}),
    )
    assert build(config, registry) == by_hand
    ready = {"estimator": by_hand.estimator, "sensors": {"radar": by_hand.sensors["radar"]}, "lifecycle": by_hand.lifecycle}
    assert build({**config, **ready}, registry) == by_hand


def test_building_leaves_the_config_as_it_was(registry: Registry) -> None:
    config = experiment_config()
    before = copy.deepcopy(config)
    load(config, registry, ["estimator.modes[1].kind=ekf", "gate.probability=0.5", "lifecycle.kind=existence"])
    assert config == before


def test_an_experiment_is_flat_and_build_checks_all_of_it(registry: Registry) -> None:
    experiment = load(experiment_config(), registry)
    assert (experiment.title, experiment.seed, experiment.source) == ("two sensors", 7, None)
    assert build(experiment_config(), registry) == experiment.tracker
    with pytest.raises(ConfigError, match=r"^seed: must be a whole number, got 1\.5$"):
        build({**experiment_config(), "seed": 1.5}, registry)
    assert load({"$schema": "vedette.json", **experiment_config()}, registry) == experiment


def test_a_config_written_back_builds_the_equal(registry: Registry) -> None:
    tracker, experiment = build(tracker_config(), registry), load(experiment_config(), registry)
    written = json.loads(json.dumps(to_config(experiment)))
    assert load(written, registry) == experiment
    assert build(json.loads(json.dumps(to_config(tracker))), registry) == tracker
    assert written["sensors"]["radar"]["sigma_bearing"] == np.deg2rad(0.5)
    other = load(written, registry, ["estimator.transition=[[0.9, 0.1], [0.05, 0.95]]"])
    assert other != experiment


def test_every_shape_of_parameter_is_written_back() -> None:
    even = Band(0, 1)
    region = Region(2.0, np.eye(2), {"a": Rate(0.5)})
    full = Band(1, 2, region, even, (even, Band(0, 3)), {"first": even}, 4, ("x", "y"))
    assert walk(json.loads(json.dumps(to_config(full)))) == full
    assert to_config(full)["hidden"] == 4
    assert walk({"low": 1, "high": 2, "inner": None, "region": None}) == Band(1, 2)


@given(
    st.floats(-1e6, 1e6),
    st.lists(st.lists(st.floats(-1e15, 1e15), min_size=3, max_size=3), min_size=1, max_size=4),
    st.dictionaries(st.text(min_size=1), st.floats(0, 1e15)),
    st.lists(st.text()),
)
def test_written_back_for_any_values(low: float, corners: Any, rates: Any, words: Any) -> None:
    region = Region(1.0, np.array(corners), {name: Rate(rate) for name, rate in rates.items()})
    band = Band(low, 1000.0 if low < 1000 else low, region, words=words) if low <= 1000 else Band(0, 1, region, words=words)
    assert walk(json.loads(json.dumps(to_config(band)))) == band


STRAIGHT = {"kind": "constant_velocity", "sigma_accel": 0.1}
TURNING = {"kind": "coordinated_turn", "sigma_accel": 0.1, "sigma_turn_rate": "1 deg/s^2"}
SHIP = {
    "start": [0, 100],
    "speed": "10 kn",
    "legs": [{"do": "turn", "seconds": 60, "rate": 0.01}, {"do": "stop", "decel": 1}],
}

# Kinds whose parameters the kit cannot guess, and some that deserve to be seen with all their parts.
EXAMPLES: list[tuple[str, dict[str, Any]]] = [
    (
        "estimator",
        {
            "kind": "imm",
            "modes": [{"kind": "ekf", "motion": STRAIGHT}, {"kind": "ukf", "motion": TURNING}],
            "rates": [[-0.1, 0.1], [0.2, -0.2]],
            "initial": [0.25, 0.75],
            "absent": {"turn_rate": [0, "0.01"]},
        },
    ),
    ("motion", {"kind": "gauss_markov", "axes": ["bias"], "sigma": 3, "tau": "2 min"}),
    ("motion", {"kind": "product", "models": [STRAIGHT, {"kind": "gauss_markov", "axes": ["z"], "sigma": 3, "tau": 60}]}),
    ("lifecycle", {"kind": "m_of_n", "spread": {"vx": 3.5}, "sensors": ["radar"], "hits": 2, "looks": 4}),
    ("source", {"kind": "autoferry", "scenario": 2, "sensors": ["radar"], "lag": {"radar": "1.7 s"}}),
    (
        "source",
        {
            "kind": "csv",
            "path": "somewhere",
            "detections": {"time": "t", "columns": {"x": "north", "y": "east"}, "units": {"x": "km"}},
            "truth": {"file": "truth.csv", "time": "t", "columns": {"x": "north", "y": "east"}},
        },
    ),
    (
        "source",
        {
            "kind": "simulation",
            "duration": "1 h",
            "looks": {"radar": {"interval": 3}},
            "ships": {"ferry": SHIP},
            "drawn": {"buoy": {"models": [STRAIGHT], "start": {"x": [0, 1], "y": [0, 1], "vx": [0, 1], "vy": [0, 1]}}},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 3}},
        },
    ),
]


def component(role: str, config: dict[str, Any], registry: Registry) -> Any:
    """A component by itself."""
    walker = Walker(registry)
    entry = registry.get(role, config["kind"])
    built = walker.construct(entry.cls, entry.parameters, config, role, set())
    assert walker.problems == []
    return built


@pytest.mark.parametrize(("role", "config"), EXAMPLES, ids=[config["kind"] for _, config in EXAMPLES])
def test_a_component_is_written_back(registry: Registry, role: str, config: dict[str, Any]) -> None:
    first = component(role, config, registry)
    assert component(role, json.loads(json.dumps(to_config(first))), registry) == first


INSTALLED = Registry.installed()
DRAWN = [entry for entry in INSTALLED if entry.kind not in {config["kind"] for _, config in EXAMPLES}]


@pytest.mark.parametrize("entry", DRAWN, ids=[f"{entry.role}-{entry.kind}" for entry in DRAWN])
def test_every_installed_component_is_written_back(entry: Installed) -> None:
    try:
        drawn = components(entry.cls)
    except Misuse as why:
        pytest.skip(str(why))

    @settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
    @given(drawn)
    def written_back(first: Any) -> None:
        assert component(entry.role, json.loads(json.dumps(to_config(first))), INSTALLED) == first

    try:
        written_back()
    except Unsatisfiable as why:
        pytest.skip(f"the kit finds no parameters: {why}")


def test_what_no_config_can_hold_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot hold a Generator"):
        plain({"rng": np.random.default_rng(0)})


@pytest.mark.parametrize(
    ("config", "lines"),
    [
        ({}, ["low: missing", "high: missing: upper end"]),
        ({"lwo": 1, "high": 2}, ["lwo: unknown; did you mean 'low'?"]),
        ({"low": "a", "high": True}, ["low: could not convert", "high: must be a number, got True"]),
        ({"low": 3, "high": 2}, ["low: must be at most high, got 3 > 2"]),
        ({"low": 1, "high": 2000}, ["the band is too high as a whole"]),
        ({"low": 1, "high": 2, "several": [LEAST] * 3}, ["several[2]: must be two at most, got 3"]),
        ({"low": 1, "high": 2, "region": 3}, ["region: must be a table of width, corners, rates, got 3"]),
        ({"low": 1, "high": 2, "region": {}}, ["region.width: missing: east to west, in m"]),
        (
            {"low": 1, "high": 2, "region": {"width": -1, "corners": [[1, 2], [3]], "rates": {"a b": {"per_scan": -1}}}},
            ["region.width: must be > 0", "region.corners: must be numbers", 'region.rates."a b".per_scan: must be >= 0'],
        ),
        ({"low": 1, "high": 2, "several": LEAST}, ["several: must be a list of associator, got a table"]),
        ({"low": 1, "high": 2, "named": [LEAST]}, ["named: must be a table of names to associator, got a list of 1"]),
        ({"low": 1, "high": 2, "named": {"a": {**LEAST, "low": 9}}}, ["named.a.low: must be at most high"]),
        ({"low": 1, "high": 2, "named": {3: LEAST}}, ["named: names must be strings, got 3"]),
        (
            {"low": 1, "high": 2, "several": [LEAST, {"kind": "bend"}, 3]},
            ["several[1].kind: unknown", "several[2]: must be"],
        ),
        ({"low": 1, "high": 2, "inner": "band"}, ["inner: must be a table whose kind is 'band', got 'band'"]),
        ({"low": 1, "high": 2, "inner": {"knd": "band"}}, ["inner.knd: unknown; did you mean 'kind'?"]),
        ({"low": 1, "high": 2, "inner": {"low": 1}}, ["inner.kind: missing: must be 'band'"]),
        ({"low": 1, "high": 2, "inner": {"kind": ["band"]}}, ["inner.kind: must be 'band', got a list of 1"]),
        (
            {"low": 1, "high": 2, "words": "xy", "hidden": 0.5},
            ["hidden: must be a whole number", "words: must be a list of"],
        ),
        ({"low": 1, "high": 2, "hidden": 101}, ["hidden: must be 100 at most, got 101"]),
        ({"low": 1, "high": 2, "_hidden": 1}, ["_hidden: unknown; did you mean 'hidden'?"]),
    ],
)
def test_every_problem_is_told_once_at_its_path(config: dict[str, Any], lines: list[str]) -> None:
    told = walk(config)
    assert len(told) == len(lines), told
    assert all(line.startswith(start) for line, start in zip(told, lines, strict=True)), told


def test_a_long_value_is_not_quoted_whole() -> None:
    (line,) = walk({"low": 1, "high": 2, "region": {"width": 1, "corners": [[1.0] * 500, [1.0]]}})
    assert len(line) < 500
    assert line.endswith(" ...")


def test_a_ready_object_of_another_role_is_refused(registry: Registry) -> None:
    sensor = build(tracker_config(), registry).sensors["lidar"]
    with pytest.raises(ConfigError, match=r"^associator: must be a table whose kind is .*, got a CartesianPosition$"):
        build({**tracker_config(), "associator": sensor}, registry)


@frozen
class Wide(Sensor):
    """A narrower role: not all sensors are wide."""


@frozen
class Pair(Associator):
    """Takes an estimator of any belief, and a wide sensor."""

    kind: ClassVar[str] = "pair"
    estimator: Estimator[Any] | None = fields.part("generic", default=None)
    sensor: Wide | None = fields.part("narrow", default=None)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        return scores


def test_a_part_can_be_narrower_than_its_role(registry: Registry) -> None:
    walker = Walker(registry)
    given = {"estimator": {"kind": "kalmann"}, "sensor": {"kind": "cartesian_position", "sigma": 1}}
    walker.construct(Pair, parameters(Pair), given, "", set())
    estimator, sensor = map(str, walker.problems)
    assert estimator.startswith("estimator.kind: unknown kind 'kalmann'; did you mean 'kalman'?")
    assert sensor.startswith("sensor.kind: unknown kind 'cartesian_position'")


def test_files_of_all_formats_say_the_same(tmp_path: Path, registry: Registry) -> None:
    toml = """
title = "two sensors"
seed = 7
gate = { probability = 0.95, clutter = "nonparametric" }
associator.kind = "pda"
judge.cover_radius = 30

[estimator]
kind = "imm"
transition = [[0.95, 0.05], [0.05, 0.95]]
absent.turn_rate = [0.0, 0.01]

[[estimator.modes]]
kind = "ekf"
motion = { kind = "constant_velocity", sigma_accel = 0.05 }

[[estimator.modes]]
kind = "ukf"
motion = { kind = "coordinated_turn", sigma_accel = "0.02 g", sigma_turn_rate = 0.01 }

[sensors]
radar = { kind = "range_bearing", sigma_range = 10.0, sigma_bearing = "0.5 deg", max_range = "10 NM" }
lidar = { kind = "cartesian_position", sigma = 1 }

[lifecycle]
kind = "m_of_n"
spread = { vx = 10, vy = 10, turn_rate = 0.01 }
"""
    yaml = pytest.importorskip("yaml")
    (tmp_path / "a.toml").write_text(toml)
    (tmp_path / "a.json").write_text("\ufeff" + json.dumps(experiment_config()), encoding="utf-8")
    (tmp_path / "a.yml").write_text(yaml.safe_dump(experiment_config()))
    wanted = load(experiment_config(), registry)
    assert load(tmp_path / "a.toml", registry) == wanted
    assert load(str(tmp_path / "a.json"), registry) == wanted
    assert load(tmp_path / "a.yml", registry) == wanted


def test_yaml_without_its_package_names_the_cure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yaml", None)
    (tmp_path / "a.yaml").write_text("seed: 3\n")
    with pytest.raises(ConfigError, match=r"a.yaml: reading YAML needs pyyaml: pip install 'vedette\[yaml\]'"):
        load(tmp_path / "a.yaml", SMALL)
