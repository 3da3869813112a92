"""Wrong configs: each is refused with the place, what is wrong there, and nothing else."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import frozen

from vedette import Array, ConfigError, Registry, Sensor, Space
from vedette.config import build, load
from vedette.units import in_unit


@frozen
class Sonar(Sensor):
    """Sees how deep a target is."""

    kind: ClassVar[str] = "sonar"

    @property
    def observes(self) -> Space:
        return Space.of(x="m", depth="m")

    @property
    def measurement(self) -> Space:
        return Space.of(depth="m")

    def measure(self, x: Array) -> Array:
        return x[..., 1:]

    def noise(self, x: Array) -> Array:
        return np.eye(1)

    def detects(self, x: Array) -> Array:
        return np.ones(x.shape[:-1])

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


def good() -> dict[str, Any]:
    return {
        "title": "harbour",
        "seed": 3,
        "estimator": {
            "kind": "imm",
            "modes": [
                {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
                {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": 0.2, "sigma_turn_rate": 0.01}},
            ],
            "transition": [[0.95, 0.05], [0.05, 0.95]],
        },
        "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01, "max_range": 1e4}},
        "gate": {"probability": 0.99},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10, "vy": 10, "turn_rate": 0.01}},
        "lifecycle": {"kind": "m_of_n"},
        "judge": {"cover_radius": 60},
    }


def deep(levels: int) -> Any:
    value: Any = {"kind": "constant_velocity", "sigma_accel": 1}
    for _ in range(levels):
        value = {"kind": "imm", "modes": [value], "transition": [[1]]}
    return value


def endless() -> dict[str, Any]:
    table: dict[str, Any] = {"kind": "ekf"}
    table["motion"] = table
    return table


DELETE = object()
ACCEL = "estimator.modes[1].motion.sigma_accel"


# One change to the good config: where, the value put there, the path told, a piece of the message.
WRONG: list[tuple[str, Any, str, str]] = [
    # kinds
    ("estimator.kind", "imn", "estimator.kind", "unknown kind 'imn'; did you mean 'imm'? installed: "),
    ("estimator.kind", "pda", "estimator.kind", "unknown kind 'pda'; it is a kind of associator"),
    ("estimator.kind", 3, "estimator.kind", "must be the name of a kind, got 3; installed: "),
    ("estimator.kind", DELETE, "estimator.kind", "missing; installed: "),
    ("estimator.modes[0].motion.kind", "warp", "estimator.modes[0].motion.kind", "unknown kind 'warp'; installed: "),
    ("sensors.radar.kind", "polar", "sensors.radar.kind", "unknown kind 'polar'; did you mean 'polar_position'?"),
    # names
    ("estimater", {}, "estimater", "unknown; did you mean 'estimator'?"),
    ("tracker", {}, "tracker", "unknown; a config takes estimator, sensors"),
    ("estimator.modes[1].motion.sigma_acel", 1, "estimator.modes[1].motion.sigma_acel", "did you mean 'sigma_accel'?"),
    ("gate.probabilty", 0.9, "gate.probabilty", "unknown; did you mean 'probability'? Gate takes probability, clutter"),
    ("associator.sigma", 3, "associator.sigma", "unknown; 'pda' takes kind"),
    ("sensors.radar.sigma_bearing", DELETE, "sensors.radar.sigma_bearing", "missing: "),
    ("estimator", DELETE, "estimator", "missing: "),
    ("sensors", DELETE, "sensors", "missing: "),
    # numbers
    (ACCEL, -3, ACCEL, "must be > 0, got -3 m/s^1.5"),
    (ACCEL, 0, ACCEL, "must be > 0, got 0 m/s^1.5"),
    (ACCEL, "3 kg", ACCEL, "must be in m/s^1.5 or m/s^2 or g, got '3 kg'"),
    (ACCEL, "-3 g", ACCEL, "must be > 0, got -29.42 m/s^1.5"),
    (ACCEL, "fast", ACCEL, "must be a number in m/s^1.5, got 'fast'"),
    (ACCEL, float("nan"), ACCEL, "must be a finite number of at most 1e+15, got nan"),
    (ACCEL, "nan", ACCEL, "must be a finite number"),
    (ACCEL, float("inf"), ACCEL, "must be a finite number"),
    (ACCEL, 1e300, ACCEL, "must be a finite number of at most 1e+15, got 1e+300"),
    (ACCEL, 10**400, ACCEL, "must be a number in m/s^1.5"),
    (ACCEL, True, ACCEL, "must be a number in m/s^1.5, got True"),
    (ACCEL, None, ACCEL, "must be a number in m/s^1.5, got None"),
    (ACCEL, [1, 2], ACCEL, "must be a number in m/s^1.5, got [1, 2]"),
    (ACCEL, {"mean": 1}, ACCEL, "must be a number in m/s^1.5, got {'mean': 1}"),
    ("sensors.radar.sigma_range", "10 s", "sensors.radar.sigma_range", "must be in m or km or NM or ft, got '10 s'"),
    ("gate.probability", 1.5, "gate.probability", "must be > 0 and <= 1, got 1.5"),
    ("judge.sensor", "lidar", "judge.sensor", "must be one of 'radar', got 'lidar'"),
    ("sensors", {}, "sensors", "must hold at least one sensor, got none"),
    ("gate.probability", 99, "gate.probability", "must be > 0 and <= 1, got 99"),
    ("gate.clutter", "sensr", "gate.clutter", "must be one of 'sensor', 'nonparametric', got 'sensr'"),
    ("seed", -1, "seed", "must be >= 0 and <= 1e+09, got -1"),
    ("seed", 1.5, "seed", "must be a whole number, got 1.5"),
    ("title", 3, "title", "must be a string, got 3"),
    ("lifecycle.hits", 0, "lifecycle.hits", "must be >= 1"),
    # shapes
    ("estimator", "imm", "estimator", "must be a table that names its kind, as { kind = 'imm' }, got 'imm'; installed: "),
    ("estimator", [], "estimator", "got a list of 0"),
    ("estimator.modes", {"kind": "ekf"}, "estimator.modes", "must be a list of estimators, got a table"),
    ("estimator.modes", [], "estimator.modes", "must hold at least one"),
    ("estimator.modes[0]", 7, "estimator.modes[0]", "must be a table that names its kind"),
    ("sensors", [{"kind": "range_bearing"}], "sensors", "must be a table of names to sensors, got a list of 1"),
    ("sensors.radar", None, "sensors.radar", "must be a table that names its kind"),
    ("gate", 0.99, "gate", "must be a table of probability, clutter, largest_distance, got 0.99"),
    ("judge", "strict", "judge", "must be a table of "),
    ("birth.spread", [10, 10], "birth.spread", "must be a table of names, got [10, 10]"),
    ("birth.spread", {"vx": 10, "vy": "fast", "turn_rate": 0.01}, "birth.spread.vy", "must be a number, got 'fast'"),
    ("estimator.absent", {"turn_rate": [0]}, "estimator.absent.turn_rate", "must be [mean, standard deviation], got [0]"),
    ("estimator.absent", {"turn_rate": [0, -1]}, "estimator.absent.turn_rate", "must be >= 0, got -1"),
    # matrices
    ("estimator.transition", [[0.95, 0.05], [0.05]], "estimator.transition", "rows of one length"),
    ("estimator.transition", [0.95, 0.05], "estimator.transition", "must have 2 axes, got 1"),
    ("estimator.transition", [[0.9, 0.05], [0.05, 0.95]], "estimator.transition", "sum to 1"),
    ("estimator.transition", [[1.1, -0.1], [0.05, 0.95]], "estimator.transition", "must be >= 0, got -0.1"),
    ("estimator.transition", [[float("nan"), 1], [0, 1]], "estimator.transition", "must be finite numbers"),
    ("estimator.transition", [["a", "b"], ["c", "d"]], "estimator.transition", "must be numbers"),
    ("estimator.transition", [["1", "0"], ["0", "1"]], "estimator.transition", "must be numbers"),
    ("estimator.transition", [[True, False], [0, 1]], "estimator.transition", "must be numbers"),
    ("estimator.transition", [[10**400, 0], [0, 1]], "estimator.transition", "must be numbers"),
    ("estimator.transition", [[1]], "estimator.transition", "one row for each of the 2 modes, got 1"),
    # rules across parts
    ("estimator", {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}}, "sensors.radar", "linear"),
    ("estimator.modes[0].kind", "kalman", "sensors.radar", "linear"),
    # nesting
    ("estimator", deep(20), "estimator", "is nested deeper than 32 levels"),
    ("estimator", endless(), "estimator", "is nested deeper than 32 levels"),
]


def changed(where: str, value: Any) -> dict[str, Any]:
    config = copy.deepcopy(good())
    *steps, last = [int(step) if step.isdigit() else step for step in re.findall(r"\w+", where)]
    place: Any = config
    for step in steps:
        place = place[step]
    if value is DELETE:
        del place[last]
    else:
        place[last] = value
    return config


def test_the_good_config_is_good(registry: Registry) -> None:
    load(good(), registry)


@pytest.mark.parametrize(("where", "value", "path", "piece"), WRONG, ids=range(len(WRONG)))
def test_a_wrong_config_is_refused_at_its_place(registry: Registry, where: str, value: Any, path: str, piece: str) -> None:
    with pytest.raises(ConfigError) as caught:
        build(changed(where, value), registry)
    (problem,) = caught.value.problems
    assert problem.place == path, problem
    assert piece in problem.text, problem
    assert "\n" not in problem.text


def test_a_sensor_that_looks_at_axes_the_model_lacks_is_told_with_both_lists(registry: Registry) -> None:
    config = changed("sensors.sonar", {"kind": "sonar"})
    with pytest.raises(ConfigError) as caught:
        build(config, Registry((*registry, *Registry.of(Sonar))))
    (problem,) = caught.value.problems
    assert problem.place == "sensors.sonar"
    assert "(x [m], depth [m])" in problem.text
    assert "(x [m], y [m], vx [m/s], vy [m/s], turn_rate [rad/s])" in problem.text


def test_all_problems_are_told_at_once_in_the_order_of_the_config(registry: Registry) -> None:
    config = good()
    config["estimator"]["modes"][1]["motion"]["sigma_accel"] = -3
    config["estimator"]["transitoin"] = config["estimator"].pop("transition")
    config["sensors"]["radar"]["sigma_range"] = "wide"
    config["lifecycel"] = config.pop("lifecycle")
    config["seed"] = "three"
    with pytest.raises(ConfigError) as caught:
        load(config, registry)
    assert [problem.place for problem in caught.value.problems] == [
        "lifecycel",
        "estimator.transitoin",
        "estimator.modes[1].motion.sigma_accel",
        "sensors.radar.sigma_range",
        "seed",
    ]
    assert str(caught.value).count("\n") == 4


@pytest.mark.parametrize("config", [[], 3, None, ["estimator"]])
def test_a_config_that_is_no_table_is_refused(registry: Registry, config: Any) -> None:
    with pytest.raises(ConfigError, match="a config must be a table"):
        build(config, registry)


def test_an_empty_table_lacks_everything_that_is_required(registry: Registry) -> None:
    with pytest.raises(ConfigError) as caught:
        build({}, registry)
    assert [problem.place for problem in caught.value.problems] == [
        "estimator",
        "sensors",
        "associator",
        "lifecycle",
    ]


def test_repeated_references_do_not_blow_up(tmp_path: Path, registry: Registry) -> None:
    pytest.importorskip("yaml")
    lists = ["&a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lists += [f"&a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 20)]
    path = tmp_path / "bomb.yaml"
    path.write_text(f"bomb: [{', '.join(lists)}]")
    with pytest.raises(ConfigError, match=r"^bomb: holds more than 10000000 values$"):
        load(path, registry)


@pytest.mark.parametrize("part", ["estimator", "associator", "lifecycle"])
def test_an_array_is_no_table(part: str) -> None:
    """Arrays of numpy are compared element by element, so that asking whether one is a kind once raised ValueError."""
    with pytest.raises(ConfigError) as caught:
        build(good() | {part: np.zeros(3)})
    assert {problem.place for problem in caught.value.problems} == {part}


def test_a_long_kind_is_cut_where_it_is_told() -> None:
    config = good()
    config["associator"] = {"kind": "k" * 100_000}
    with pytest.raises(ConfigError) as caught:
        build(config)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("text", ["1_0", "1_0 m"])
def test_a_number_as_python_alone_writes_it_is_none(text: str) -> None:
    with pytest.raises(ValueError, match="number"):
        in_unit(text, "m")
