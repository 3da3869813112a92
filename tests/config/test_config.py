"""Configs are walked together with the classes: built, and judged with every problem at its path."""

from __future__ import annotations

import copy
import json
import sys
from pathlib import Path
from typing import Any, ClassVar

import pytest
from attrs import frozen

import vedette
from support.configs import LEAST, SMALL, experiment_config, tracker_config, walk
from vedette import Array, Associator, ConfigError, Estimator, Registry, Sensor, fields
from vedette.config import build, load
from vedette.config.builder import Builder
from vedette.config.parameters import parameters


def test_a_config_builds_what_its_author_would_write_in_python(registry: Registry) -> None:
    from vedette_standard.associators.pda import Pda
    from vedette_standard.births.from_returns import FromReturns
    from vedette_standard.estimators.kalman import Kalman
    from vedette_standard.lifecycles.m_of_n import MOfN
    from vedette_standard.motion.constant_velocity import ConstantVelocity
    from vedette_standard.sensors.cartesian_position import CartesianPosition

    config = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 2}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": "0.5 km"}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
    by_hand = vedette.Tracker(
        estimator=Kalman(ConstantVelocity(2.0)),
        sensors={"radar": CartesianPosition(500.0)},
        associator=Pda(),
        lifecycle=MOfN(),
        birth=FromReturns(spread={"vx": 10.0, "vy": 10.0}),
    )
    assert build(config, registry) == by_hand
    ready = {"estimator": by_hand.estimator, "sensors": {"radar": by_hand.sensors["radar"]}, "lifecycle": by_hand.lifecycle}
    assert build({**config, **ready, "birth": by_hand.birth}, registry) == by_hand


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
        ({"low": 1, "high": 2, "several": LEAST}, ["several: must be a list of associators, got a table"]),
        ({"low": 1, "high": 2, "named": [LEAST]}, ["named: must be a table of names to associators, got a list of 1"]),
        ({"low": 1, "high": 2, "named": {"a": {**LEAST, "low": 9}}}, ["named.a.low: must be at most high"]),
        ({"low": 1, "high": 2, "named": {3: LEAST}}, ["named: names must be strings, got 3"]),
        (
            {"low": 1, "high": 2, "several": [LEAST, {"kind": "bend"}, 3]},
            ["several[1].kind: unknown", "several[2]: must be"],
        ),
        (
            {"low": 1, "high": 2, "inner": "band"},
            ["inner: must be a table that names its kind, as { kind = 'band' }, got 'band'; installed: band"],
        ),
        ({"low": 1, "high": 2, "inner": {"knd": "band"}}, ["inner.knd: unknown; did you mean 'kind'?"]),
        ({"low": 1, "high": 2, "inner": {"low": 1}}, ["inner.kind: missing; installed: band"]),
        (
            {"low": 1, "high": 2, "inner": {"kind": ["band"]}},
            ["inner.kind: must be the name of a kind, got a list of 1; installed: band"],
        ),
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
    with pytest.raises(ConfigError, match=r"^associator: must be a table.*got a CartesianPosition; installed: "):
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
    builder = Builder(registry)
    given = {"estimator": {"kind": "kalmann"}, "sensor": {"kind": "cartesian_position", "sigma": 1}}
    builder.construct(Pair, parameters(Pair), given, "", set())
    estimator, sensor = map(str, builder.problems)
    assert estimator.startswith("estimator.kind: unknown kind 'kalmann'; did you mean 'kalman'?")
    assert sensor.startswith("sensor.kind: must be a Wide, and 'cartesian_position' is none;")


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

[birth]
kind = "from_returns"
spread = { vx = 10, vy = 10, turn_rate = 0.01 }

[lifecycle]
kind = "m_of_n"
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
