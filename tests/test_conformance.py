"""Every component that is installed here keeps the laws of its role. One that nobody thought of is in the loop too."""

import sys

import pytest
from hypothesis import strategies as st

from vedette.registry import Registry
from vedette.testing import conformance
from vedette.testing.strategies import SENSOR
from vedette_bayes_risk.risk import Costs
from vedette_sim import Drawn, Look
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

DRAWN = Drawn(
    models=(ConstantVelocity(sigma_accel=0.5),),
    start={"x": (0, 10), "y": (5, 10), "vx": (3, 1), "vy": (-2, 1)},
    appears=1.0,
)
SIMULATION = {
    "duration": st.floats(2.0, 12.0),
    "looks": st.just({SENSOR: Look(interval=1.0, jitter=0.3)}),
    "drawn": st.sampled_from([{}, {"boat": DRAWN}, {"boat": DRAWN, "other": DRAWN}]),
}

SIDE_BY_SIDE = st.sampled_from(
    [
        (ConstantVelocity(0.5), ConstantVelocity(0.1, axes=("z",))),
        (CoordinatedTurn(0.5, 0.02), GaussMarkov(("bias",), 0.02, 60.0, "rad")),
    ]
)

SENSORS = {name: CartesianPosition(sigma, 0.9, 1e-5) for name, sigma in (("a", 5.0), ("b", 8.0), ("c", 5.0))}
COUNTING = {"sensors": st.just(SENSORS), "base": st.sampled_from(sorted(SENSORS)), "threshold": st.floats(5.0, 100.0)}
COSTS = {"costs": st.sampled_from([Costs(), Costs(miss=3.0, false_alarm=0.5, detection=0.1, rejection=0.1, prior=0.2)])}

GIVEN = {
    ("detector", "bayes_risk_detection"): COUNTING | COSTS,
    ("detector", "bayes_risk_printed"): COUNTING | COSTS,
    ("detector", "count_likelihood_detection"): COUNTING,
    ("source", "simulation"): SIMULATION,
    ("motion", "gauss_markov"): {"axes": st.sampled_from([("b",), ("b", "c")])},
    ("motion", "product"): {"models": SIDE_BY_SIDE},
    ("sensor", "biased"): {
        "of": st.builds(RangeBearing, st.floats(1.0, 50.0), st.floats(1e-3, 0.05)),
        "add": st.sampled_from([{}, {"bearing": "turned"}, {"range": "long", "bearing": "turned"}]),
        "offset": st.sampled_from([{}, {"x": "north", "y": "east"}]),
        "lag": st.sampled_from(["", "late"]),
        "spread": st.just({}),  # the kit draws biases of any size, beyond what a start knows
    },
}
"""Strategies for what cannot be inferred."""

BREAKS = {
    ("estimator", "parallel_kalman_printed"): {
        "test_soft_weights_give_the_mixtures_moments": "the paper prints the covariance without the spread of the means"
    }
}
"""Laws that a component breaks on purpose: it is kept to be compared with."""

NEED_FILES = {("source", "autoferry"), ("source", "csv"), ("source", "jsonl")}
"""Sources that read a recording: tests below give each its file."""

INSTALLED = [entry for entry in Registry.installed() if entry.role != "study"]

for entry in INSTALLED:
    if (entry.role, entry.kind) not in NEED_FILES:
        name = f"Test_{entry.role}_{entry.kind}"
        vars(sys.modules[__name__])[name] = made = conformance(entry.cls, **GIVEN.get((entry.role, entry.kind), {}))
        for law, why in BREAKS.get((entry.role, entry.kind), {}).items():
            setattr(made, law, pytest.mark.xfail(strict=True, reason=why)(getattr(made, law)))
