"""Configs written back build the equal."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable

from support.configs import Band, Rate, Region, experiment_config, tracker_config, walk
from vedette import Registry
from vedette.config import build, load, to_config
from vedette.config.builder import Builder
from vedette.config.parameters import plain
from vedette.config.registry import Installed
from vedette.testing.comparisons import Misuse
from vedette.testing.strategies import components


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
@pytest.mark.costly
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
    ("birth", {"kind": "from_returns", "spread": {"vx": 3.5}, "sensors": ["radar"]}),
    ("lifecycle", {"kind": "m_of_n", "hits": 2, "looks": 4}),
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
    builder = Builder(registry)
    entry = registry.get(role, config["kind"])
    built = builder.construct(entry.cls, entry.parameters, config, role, set())
    assert builder.problems == []
    return built


@pytest.mark.parametrize(("role", "config"), EXAMPLES, ids=[config["kind"] for _, config in EXAMPLES])
def test_a_component_is_written_back(registry: Registry, role: str, config: dict[str, Any]) -> None:
    first = component(role, config, registry)
    assert component(role, json.loads(json.dumps(to_config(first))), registry) == first


INSTALLED = Registry.installed()
DRAWN = [entry for entry in INSTALLED if entry.kind not in {config["kind"] for _, config in EXAMPLES}]


@pytest.mark.parametrize("entry", DRAWN, ids=[f"{entry.role}-{entry.kind}" for entry in DRAWN])
@pytest.mark.costly
def test_every_installed_component_is_written_back(entry: Installed) -> None:
    try:
        drawn = components(entry.cls)
    except Misuse as why:
        pytest.skip(str(why))

    @settings(max_examples=20, suppress_health_check=list(HealthCheck))
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
