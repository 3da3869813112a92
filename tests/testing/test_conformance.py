"""Every component that is installed here keeps the laws of its role. One that nobody thought of is in the loop too.

By day those that changed and a fifth of the others are tried (`support.selection`), by night and with `--all` all.
"""

import sys
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import strategies as st

import vedette
from vedette.config.parameters import APART, ROLES
from vedette.config.registry import Registry
from vedette.testing import conformance, examine, laws_of
from vedette.testing.laws.source import OTHER
from vedette.testing.strategies import SENSOR, components
from vedette_bayes_risk.risk import Costs
from vedette_files import write_recording
from vedette_files.tables.returns import DetectionColumns
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_marine.geometry import PictureGeometry
from vedette_marine.picture.chain import Chain
from vedette_marine.screen import RadarScreen
from vedette_sim import Bounds, Drawn, Leg, Look, PpiRadar, RadarPicturesScene, Ship, Transponder, Vessel
from vedette_sim.crossing import Crossing
from vedette_sim.infrared import HotSpot, HotTarget
from vedette_sim.sea import SeaClutter
from vedette_standard.births.places import Edge
from vedette_standard.births.poisson import Appearance
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.regions import Polygon
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

DRAWN = Drawn(
    models=(ConstantVelocity(sigma_accel=0.5),),
    start={"x": (0, 10), "y": (5, 10), "vx": (3, 1), "vy": (-2, 1)},
    appears=1.0,
)
TURNING = Drawn(
    models=(ConstantVelocity(sigma_accel=0.5), CoordinatedTurn(0.5, 0.02)),
    start={"x": (0, 10), "y": (5, 10), "vx": (3, 1), "vy": (-2, 1), "turn_rate": (0.1, 0.1)},
    transition=[[0.9, 0.1], [0.1, 0.9]],
    appears=1.0,
)
LEGS = (
    Leg("turn", seconds=2.0, rate=0.5),
    Leg("accelerate", seconds=2.0, accel=3.0),
    Leg("push", seconds=3.0, push=np.array([12.0, -6.0])),
    Leg("stop", decel=20.0),
)


def comes_and_goes():
    """A ship on legs, laid when it is drawn: a mutant of legs lays its own."""
    return Ship(start=[200.0, -350.0], course=2.0, speed=9.0, legs=LEGS, appears=1.5, disappears=8.0)


EVERYWHERE = Bounds(-600.0, 600.0)
CLUTTERED = Look(interval=0.5, first=1.5, clutter={"x": EVERYWHERE, "y": EVERYWHERE})
OFTEN = Look(interval=0.01, first=1.5)
"""A scene of it is drawn in more than one block of scans."""
CROSSING = st.builds(Crossing, st.just((ConstantVelocity(0.5),)), st.just((20.0, 9.0)), st.just(3.0), st.just(8.0))
SIMULATION = {
    "duration": st.floats(4.0, 12.0),
    "looks": st.sampled_from(
        [{SENSOR: look} for look in (Look(interval=0.05, first=1.5), CLUTTERED, Look(interval=1.0, jitter=0.3), OFTEN)]
        + [{SENSOR: CLUTTERED}, {SENSOR: Look(interval=0.05, first=1.5), OTHER: Look(interval=0.7, first=1.6)}]
    ),
    "ships": st.one_of(st.just({}), st.fixed_dictionaries({"ship": st.builds(comes_and_goes)})),
    "drawn": st.sampled_from([{"boat": DRAWN}, {"boat": DRAWN, "other": TURNING}, {"boat": TURNING}, {}]),
    "crossings": st.one_of(st.just({}), st.fixed_dictionaries({"two": CROSSING, "more": CROSSING})),
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

BOXED = st.builds(
    lambda motion: Carrying(motion, {"width": "px", "height": "px"}), st.builds(ConstantVelocity, st.floats(0.1, 1.0))
)

SPOTS = (HotSpot(80.0, 2.0), HotSpot(80.0, 2.0, x=-5.0), HotSpot(80.0, 2.0, x=5.0))
IN_THE_MIDDLE = {"x": (20.0, 2.0), "y": (24.0, 2.0), "vx": (0.0, 5.0), "vy": (0.0, 5.0)}


def vessels():
    """Two ships, one of which comes and goes."""
    boat = Vessel(Ship(start=[-200.0, 300.0], speed=8.0), length=40.0, width=8.0, ais=Transponder(antenna=[-10.0, 1.0]))
    return {"boat": boat, "ferry": Vessel(comes_and_goes(), length=30.0, width=9.0)}


PICTURES = {
    "radar": st.sampled_from(
        [PpiRadar(metres_per_pixel=20.0, range=600.0, size=64, azimuths=128, beam=0.06, calm=calm) for calm in (0.0, 400.0)]
    ),
    "vessels": st.builds(vessels),
    "frames": st.just(5),
    "interval": st.sampled_from([1.0, 2.5]),
    "lost": st.sampled_from([0, 2]),
    "ownship": st.just(Ship(start=[0.0, 0.0])),
    "sea": st.sampled_from([None, SeaClutter(level=-10.0)]),
    **dict.fromkeys(("land", "rain", "buoys", "racons"), st.just(())),
}

GREEN_AND_WHITE = [[0, 0, 0], [0, 255, 0], [255, 255, 255]]
EXTENDED = st.fixed_dictionaries(
    {SENSOR: components(RangeBearing, {"sigma_extent": st.sampled_from([0.0, 4.0, 30.0]), "min_range": st.just(0.0)})}
)
SLANTED = Polygon([[-300.0, -250.0], [280.0, -320.0], [350.0, 40.0], [60.0, -20.0], [-120.0, 330.0]])
AREAS = {"survives_in": st.sampled_from([(), (SLANTED,), (SLANTED, Polygon([[400.0, 0.0], [500.0, 90.0], [380.0, 200.0]]))])}
PLANE = ("x", "y", "vx", "vy")
ACCELERATED = {"ax": (0.0, 0.5), "ay": (0.3, 0.4)}
EDGE = Edge((-300.0, 200.0), (300.0, 100.0), 40.0, (-9.0, 3.0), others=ACCELERATED, initial=2.0, rate=0.05)

BIASES = {"turned": 0.01, "north": 30.0, "east": 30.0, "late": 0.5, "vx": 10.0, "vy": 10.0}
"""Of what is known where a track starts; not that of ranges, which would make some of them negative."""


def biased(add, offset, lag, known):
    """Parameters that go together: the spread is of biases that there are, and of velocities if it is late."""
    names = {*add.values(), *offset.values(), *([lag, "vx", "vy"] if lag else [])}
    spread = {name: BIASES[name] for name in BIASES if known and name in names}
    return {"add": add, "offset": offset, "lag": lag, "spread": spread}


BIASED = st.shared(
    st.builds(
        biased,
        st.sampled_from([{}, {"bearing": "turned"}, {"range": "long", "bearing": "turned"}]),
        st.sampled_from([{}, {"x": "north", "y": "east"}]),
        st.sampled_from(["", "late"]),
        st.booleans(),
    ),
    key="biased",
)

STEPPED = st.shared(
    st.sampled_from(
        [
            (("p", "q"), [[1.0, 0.5], [0.0, 0.9]], [[0.2, 0.1], [0.1, 0.3]], 0.5),
            (("p", "q"), [[0.0, 1.0], [-0.5, 0.2]], np.diag([0.0, 1.0]), 2.0),
            (("x", "vx"), [[1.0, 0.5], [0.0, 1.0]], np.diag([0.0, 1.0]), 0.5),
            (("x", "vx"), [[1.0, 2.0], [0.0, 1.0]], np.diag([0.0, 1.0]), 2.0),
        ]
    ),
    key="stepped",
)
"""Axes, F, Q and step of a linear motion, which go together."""

GIVEN = {
    ("estimator", "fading_memory"): {"alpha": st.floats(1.0, 1.1), "step": st.sampled_from([1.0, 10.0])},
    ("estimator", "g_h"): {"h": st.floats(0.0, 1.0), "k": st.floats(0.0, 0.05), "step": st.sampled_from([0.5, 2.0])},
    ("estimator", "least_squares"): {"forgetting": st.sampled_from([1.0, 0.95]), "step": st.sampled_from([1.0, 10.0])},
    ("estimator", "ensemble_kalman"): {"members": st.just(100)},
    ("estimator", "template_filter"): {
        "motion": BOXED,
        "cells": st.sampled_from([12, 20]),
        "limit": st.floats(0.3, 0.7),
        "margin": st.floats(1.2, 2.5),
        "opening": st.floats(2.0, 5.0),
        "sigma": st.floats(0.3, 3.0),
        "centred": st.just(False),  # the kit starts a track in the middle of its target, which has two ends
    },
    ("estimator", "correlation_filter"): {"motion": BOXED, "cells": st.sampled_from([8, 20]), "limit": st.floats(0.2, 0.7)},
    ("estimator", "whitened_filter"): {"motion": BOXED, "memory": st.floats(0.05, 1.0), "passes": st.just(2)},
    ("estimator", "residual_monitored"): {
        "of": st.builds(Kalman, st.builds(ConstantVelocity, st.floats(0.1, 1.0))),
        "blocks": st.sampled_from([(), ("x", "vx")]),
    },
    ("preprocessor", "bayes_risk_detection"): COUNTING | COSTS,
    ("preprocessor", "bayes_risk_printed"): COUNTING | COSTS,
    ("preprocessor", "bayes_risk_by_count"): COUNTING | COSTS,
    ("preprocessor", "bayes_risk_decision"): COUNTING | COSTS,
    ("preprocessor", "clustered_detection"): {
        "sensors": COUNTING["sensors"],
        "threshold": st.floats(30.0, 100.0),  # its evidence takes a target's returns to lie within the threshold
    },
    ("preprocessor", "count_likelihood_detection"): COUNTING,
    ("preprocessor", "decorrelated_conversion"): {
        "of": st.builds(
            lambda radar: UnbiasedConversion({"radar": radar}),
            st.builds(RangeBearing, st.floats(1.0, 50.0), st.floats(1e-3, 0.05)),
        )
    },
    ("preprocessor", "grouped_returns"): {"sensors": EXTENDED, "link": st.floats(0.5, 100.0), "longest": st.floats(50, 500)},
    ("preprocessor", "naive_conversion"): {"sensors": EXTENDED},
    ("preprocessor", "unbiased_conversion"): {"sensors": EXTENDED},
    ("preprocessor", "debiased_conversion"): {"sensors": EXTENDED},
    ("preprocessor", "modified_unbiased_conversion"): {"sensors": EXTENDED},
    ("preprocessor", "cfar"): {"sensors": st.just({"receiver": RadarScreen()}), "window": st.sampled_from([2, 16, 32])},
    ("preprocessor", "spot_detector"): {"sensors": st.just({"camera": BoxCentroid()}), "sides": st.just((7.0, 15.0))},
    ("preprocessor", "radar_picture"): {
        "sensors": st.just({"screen": RadarScreen()}),
        "chain": st.just(Chain(nearest=20.0)),
        "geometry": st.sampled_from(
            [PictureGeometry(m, [79.5, 29.5], 160, 60, range=198.0 * m, colours=GREEN_AND_WHITE) for m in (5.0, 20.0)]
        ),
        "sigma_bearing": st.sampled_from([0.02, 0.0]),
    },
    ("source", "simulation"): SIMULATION,
    ("source", "infrared_scene"): {
        "targets": st.sampled_from(
            [{"spot": HotTarget(ImageVelocity(20.0), SPOTS, IN_THE_MIDDLE, turn_rate=rate)} for rate in (0.0, 2.0)]
        ),
        "frames": st.just(6),
        "width": st.sampled_from([64, 40]),
        "height": st.just(48),
        "corner": st.just((0.0, 0.0)),
        "rate": st.just(30.0),
        "drift": st.sampled_from([(60.0, -30.0), (0.0, 0.0), (3.0, -1.0)]),
        "sigma": st.sampled_from([1.0, 0.2]),
        "clutter": st.sampled_from([5.0, 0.0, 2.0]),
        "clutter_time": st.sampled_from([0.2, 0.05]),
    },
    ("source", "radar_pictures_scene"): PICTURES,
    ("source", "radar_points_scene"): {
        "scene": components(RadarPicturesScene, PICTURES),
        "detection_probability": st.floats(0.95, 1.0),  # it states what a radar sees, whatever the kit's sensor would
        "sigma": st.floats(0.5, 1.5),
        "extent": st.sampled_from([0.02, 0.01]),
        "clutter": st.sampled_from([3e-5, 5e-7, 0.0]),
    },
    ("lifecycle", "coast_limited"): AREAS,
    ("lifecycle", "existence"): AREAS,
    ("lifecycle", "m_of_n"): AREAS,
    ("lifecycle", "score"): AREAS,
    ("birth", "poisson"): {
        "enter": st.sampled_from([(), (EDGE,)]),
        "appear": st.lists(
            st.builds(
                Appearance,
                st.fixed_dictionaries(
                    {name: st.tuples(st.floats(-99.0, 99.0), st.floats(50.0, 300.0)) for name in PLANE}
                ).map(lambda at: at | ACCELERATED),
                st.floats(0.1, 5.0),
                st.floats(0.0, 0.1),
            ),
            max_size=2,
        ).map(tuple),
    },
    ("birth", "uniform"): {"initial": st.floats(0.1, 5.0), "rate": st.floats(0.0, 0.1)},
    ("format", "asterix"): {"editions": st.sampled_from([{}, {"48": "1.30"}])},
    ("format", "csv_lines"): {
        "columns": st.sampled_from([("time", "x", "y"), ("sensor", "range", "bearing", "time")]),
        "units": st.sampled_from([{}, {"time": "ms"}]),
    },
    ("format", "nmea"): {"talker": st.sampled_from(["RA", "II"])},
    ("motion", "gauss_markov"): {"axes": st.sampled_from([("b",), ("b", "c")])},
    ("motion", "linear"): {
        "axes": STEPPED.map(lambda each: each[0]),
        "F": STEPPED.map(lambda each: np.array(each[1])),
        "Q": STEPPED.map(lambda each: np.array(each[2])),
        "step": STEPPED.map(lambda each: each[3]),
        "B": st.just(np.array([[0.5], [1.0]])),
        "control": st.just(np.array([2.0])),
        "units": st.just({}),
    },
    ("motion", "product"): {"models": SIDE_BY_SIDE},
    ("sensor", "linear"): {
        "axes": st.just(("x", "vx", "y")),
        "R": st.sampled_from([np.array([[4.0, 1.0], [1.0, 9.0]]), np.diag([1.0, 25.0])]),
        "H": st.sampled_from(
            [
                np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
                np.array([[1.0, 0.0, 1.0], [1.0, 0.0, -1.0]]),
                np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            ]
        ),
        "measures": st.just(()),
        "units": st.just({}),
    },
    ("sensor", "range_bearing_rate"): {"crossing_speed": st.floats(200.0, 1000.0)},  # the kit draws any velocity
    ("sensor", "biased"): {
        "of": st.builds(RangeBearing, st.floats(1.0, 50.0), st.floats(1e-3, 0.05)),
        **{name: BIASED.map(itemgetter(name)) for name in ("add", "offset", "lag", "spread")},
    },
}
"""Strategies for what cannot be inferred."""

RECORDED = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {SENSOR: {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "given"},
    "lifecycle": {"kind": "single_target"},
    "source": {
        "kind": "simulation",
        "duration": 9.0,
        "looks": {SENSOR: {"interval": 1.0}},
        "drawn": {
            "boat": {
                "models": [{"kind": "constant_velocity", "sigma_accel": 0.5}],
                "start": {"x": [0, 10], "y": [5, 10], "vx": [3, 1], "vy": [-2, 1]},
            }
        },
    },
}

NEED_FILES = {("source", kind) for kind in ("autoferry", "csv", "jsonl", "radar_pictures", "stream")}
"""Sources that read a recording: the last test writes one for those that take any sensor; the others have their own."""

WITHOUT_LAWS = (*APART, "input", "output", "store")
INSTALLED = [entry for entry in Registry.installed() if entry.role not in WITHOUT_LAWS]

for entry in INSTALLED:
    if (entry.role, entry.kind) not in NEED_FILES:
        name = f"Test_{entry.role}_{entry.kind}"
        laws = conformance(entry.cls, **GIVEN.get((entry.role, entry.kind), {}))
        vars(sys.modules[__name__])[name] = pytest.mark.kind.with_args(entry.cls)(laws)  # `kind(cls)` would mark the class


FROM_FILES = {kind: Registry.installed().get("source", kind).cls for kind in ("csv", "jsonl")}


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.kind.with_args(cls)) for kind, cls in FROM_FILES.items()]
)
@pytest.mark.by_turns
def test_a_source_that_reads_a_file_keeps_the_laws(kind, tmp_path, vedette_kit):
    recording = vedette.load(RECORDED).source.open({SENSOR: CartesianPosition(sigma=5.0)}, np.random.default_rng(0))
    if kind == "jsonl":
        path = tmp_path / "recording.jsonl"
        write_recording(path, recording, {SENSOR: CartesianPosition(sigma=5.0).measurement})
        given = {"path": st.just(str(path))}
    else:
        path = tmp_path / "returns.csv"
        rows = [f"{scan.time},{x},{y}" for scan in recording.scans for x, y in scan.detections.z]
        path.write_text("\n".join(["t,px,py", *rows]) + "\n")
        columns = DetectionColumns(time="t", columns={"x": "px", "y": "py"})
        given = {"path": st.just(str(path)), "detections": st.just(columns)}
    cls = FROM_FILES[kind]
    for law in laws_of(cls):
        outcome = vedette_kit.take(examine(cls, law, components(cls, given), vedette_kit.profile))
        closed = ("draw", "no worked example", "too little truth", "it has no ", "are no pictures", "no target of its")
        assert outcome.verdict == "held" or any(why in outcome.text for why in closed), outcome.text


def test_no_component_was_forgotten():
    tested = {name for name in vars(sys.modules[__name__]) if name.startswith("Test_")}
    wanted = {f"Test_{e.role}_{e.kind}" for e in INSTALLED if (e.role, e.kind) not in NEED_FILES}
    assert wanted <= tested
    assert {entry.role for entry in INSTALLED} == set(ROLES) - set(WITHOUT_LAWS)
