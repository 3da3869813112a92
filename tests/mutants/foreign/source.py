"""Wrong sources."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_sim as sim
import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

BOAT = sim.Drawn(
    models=(standard.ConstantVelocity(0.3),),
    start={"x": (0.0, 300.0), "y": (0.0, 300.0), "vx": (0.0, 5.0), "vy": (0.0, 5.0)},
)
LOOK = sim.Look(interval=2.0, clutter={"x": sim.Bounds(-500.0, 500.0), "y": sim.Bounds(-500.0, 500.0)})
SCENE = partial(sim.Simulation, duration=20.0, looks={"radar": LOOK}, drawn={"boat": BOAT})


def _recording(change):
    """Return an `open` that changes the recording."""
    return lambda right, sensors, rng: change(right.open(sensors, rng))


def _scans(change):
    return _recording(lambda r: attrs.evolve(r, scans=tuple(change(tuple(r.scans)))))


def _detections(change):
    return _scans(lambda scans: [attrs.evolve(s, detections=change(s.detections)) for s in scans])


def _kept():
    """Return an `open` with one generator for all that are ever opened."""
    own = np.random.default_rng(7)
    return lambda right, sensors, rng: right.open(sensors, own)


def _true_first(detections):
    """The return nearest to the middle of the scene comes first, as a sort would leave it."""
    order = np.argsort(np.linalg.norm(detections.z, axis=-1), axis=-1)
    return vedette.Detections(np.take_along_axis(detections.z, order[..., None], axis=-2), detections.valid)


source = partial(mutant, "source")

MUTANTS: tuple[Mutant, ...] = (
    source(
        "scene_unseeded",
        "The numbers come from a generator of its own: no run repeats.",
        SCENE,
        open=lambda r, sensors, rng: r.open(sensors, np.random.default_rng()),
    ),
    source("scene_goes_on", "One generator serves all runs: each scene depends on those before.", SCENE, open=_kept()),
    source(
        "scene_always_the_same",
        "The generator that comes in is not used: every run is the same.",
        SCENE,
        open=lambda r, sensors, rng: r.open(sensors, np.random.default_rng(0)),
    ),
    source("scene_undeclared", "It draws numbers, and says that it does not.", SCENE, draws=False),
    source("scene_backwards", "The scans come in the order of falling time.", SCENE, open=_scans(lambda scans: scans[::-1])),
    source(
        "scene_in_ms",
        "The scans' times are in ms.",
        SCENE,
        open=_scans(lambda scans: [attrs.evolve(s, time=1000 * s.time) for s in scans]),
    ),
    source(
        "scene_truth_late",
        "The truth's times are late by one scan.",
        SCENE,
        open=_recording(lambda r: attrs.evolve(r, truth=tuple(attrs.evolve(t, times=t.times + 2.0) for t in r.truth))),
    ),
    source(
        "scene_truth_swapped",
        "The truth's x and y change places.",
        SCENE,
        open=_recording(
            lambda r: attrs.evolve(
                r, truth=tuple(attrs.evolve(t, states=t.states[:, [1, 0, *range(2, t.states.shape[1])]]) for t in r.truth)
            )
        ),
    ),
    source(
        "scene_empty_scans_dropped",
        "Scans with fewer than 2 returns are left out.",
        SCENE,
        open=_scans(lambda scans: [s for s in scans if np.sum(s.detections.valid) > 1]),
    ),
    source(
        "scene_scans_twice",
        "Every scan is delivered twice.",
        SCENE,
        open=_scans(lambda scans: [s for s in scans for _ in range(2)]),
    ),
    source(
        "scene_other_name",
        "The scans bear a name that no sensor of the tracker has.",
        SCENE,
        open=_scans(lambda scans: [attrs.evolve(s, sensor=s.sensor.upper()) for s in scans]),
    ),
    source(
        "scene_sorted",
        "The returns of a scan are sorted: their order tells which are true.",
        SCENE,
        open=_detections(_true_first),
    ),
    source(
        "scene_false_only",
        "The last return of each scan is not valid.",
        SCENE,
        open=_detections(lambda d: attrs.evolve(d, valid=d.valid & (np.arange(d.valid.shape[-1]) < d.valid.shape[-1] - 1))),
    ),
    source(
        "scene_nan",
        "A return that was not detected is NaN, and valid.",
        SCENE,
        open=_detections(lambda d: attrs.evolve(d, z=np.where(np.arange(d.z.shape[-2])[:, None] == 0, np.nan, d.z))),
    ),
)
