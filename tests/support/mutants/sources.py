"""Sources with one thing wrong."""

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from support.mutants.parts import CALLS
from vedette import Detections
from vedette.testing.strategies import SENSOR
from vedette.types import Recording, Scan, Trajectory
from vedette_sim import Bounds, Drawn, Look, Simulation
from vedette_standard.motion.constant_velocity import ConstantVelocity

CV = ConstantVelocity
BOAT = Drawn(models=(CV(0.5),), start={"x": (0, 10), "y": (5, 10), "vx": (3, 1), "vy": (-2, 1)}, appears=1.0)
SCENE = {
    "duration": st.just(6.0),
    "looks": st.just({SENSOR: Look(interval=1.0, jitter=0.3)}),
    "drawn": st.just({"boat": BOAT}),
}


CLUTTERED = SCENE | {
    "looks": st.just({SENSOR: Look(interval=0.2, clutter={"x": Bounds(-90.0, 90.0), "y": Bounds(-90.0, 90.0)})})
}


def rescanned(change):
    """A source whose scans are changed on the way out."""

    def open(self, sensors, rng):  # noqa: A001  # the role's own name
        recording = Simulation.open(self, sensors, rng)
        return Recording(tuple(change(recording.scans)), recording.truth)

    return {"open": open}


def fresh_seed(self, sensors, rng):
    return Simulation.open(self, sensors, np.random.default_rng(next(CALLS)))


def turned_truth(self, sensors, rng):
    recording = Simulation.open(self, sensors, rng)
    return Recording(recording.scans, tuple(Trajectory(t.name, t.space, t.times[::-1], t.states) for t in recording.truth))


def true_first(self, sensors, rng):
    recording = Simulation.open(self, sensors, rng)
    scans = []
    for scan in recording.scans:
        z, states = scan.detections.z, [state for path in recording.truth if (state := path.at(scan.time)) is not None]
        places = [state[:2] for state in states] or [np.zeros(2)]
        order = np.argsort(np.min([np.sum((z - place) ** 2, axis=-1) for place in places], axis=0))
        scans.append(evolve(scan, detections=Detections.of(z[order], 2)))
    return Recording(tuple(scans), recording.truth)


SOURCES = [
    ("the seed ignored", Simulation, "the_seed_decides", {"open": fresh_seed}, SCENE),
    ("draws that are not declared", Simulation, "draws_as_declared", {"draws": False}, SCENE),
    ("no scan", Simulation, "scans_come_in_time_order", rescanned(lambda scans: scans[:0]), SCENE),
    ("scans out of order", Simulation, "scans_come_in_time_order", rescanned(lambda scans: scans[::-1]), SCENE),
    ("scans half a second late", Simulation, "scans_come_when_stated",
     rescanned(lambda scans: [evolve(scan, time=scan.time + 0.5) for scan in scans]), SCENE),
    ("no scan is early or late", Simulation, "scans_come_when_stated",
     rescanned(lambda scans: [evolve(scan, time=np.round(scan.time)) for scan in scans]),
     SCENE | {"duration": st.just(30.0)}),
    ("a sensor that nobody has", Simulation, "scans_are_the_sensors",
     rescanned(lambda scans: [evolve(scan, sensor="sonar") for scan in scans]), SCENE),
    ("returns that are no numbers", Simulation, "scans_are_the_sensors",
     rescanned(lambda scans: [Scan(s.time, s.sensor, Detections.of(s.detections.z * np.nan, 2)) for s in scans]), SCENE),
    ("scans without returns left out", Simulation, "scans_come_unseen",
     rescanned(lambda scans: [scan for scan in scans if np.any(scan.detections.valid)]), SCENE),
    ("targets' returns first", Simulation, "order_of_returns_tells_nothing", {"open": true_first}, CLUTTERED),
    ("truth backwards", Simulation, "truth_is_in_order", {"open": turned_truth}, SCENE),
]  # fmt: skip
