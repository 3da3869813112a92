"""Every component that is installed here keeps the laws of its role. One that nobody thought of is in the loop too."""

import sys

from hypothesis import strategies as st

from vedette.registry import Registry
from vedette.testing import conformance
from vedette.testing.strategies import SENSOR
from vedette_sim import Drawn, Look
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.gauss_markov import GaussMarkov
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

GIVEN = {
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

NEED_FILES = {("source", "autoferry"), ("source", "csv"), ("source", "jsonl")}
"""Sources that read a recording: tests below give each its file."""

INSTALLED = [entry for entry in Registry.installed() if entry.role != "study"]

for entry in INSTALLED:
    if (entry.role, entry.kind) not in NEED_FILES:
        name = f"Test_{entry.role}_{entry.kind}"
        vars(sys.modules[__name__])[name] = conformance(entry.cls, **GIVEN.get((entry.role, entry.kind), {}))
