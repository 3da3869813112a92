"""One run of a study anew, with the draws that it had there, to look at it."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Detections, Experiment, InputError, Progress, Recording, Scan, Trajectory
from vedette.experiment import Steps
from vedette_study.chunk import recorded
from vedette_study.plan import Plan
from vedette_study.scenes import DrawsTogether
from vedette_study.seeds import RunSeeds, sequence


def open_again(plan: Plan, point: int, run: int, progress: Progress) -> Steps:
    """Open a run at a point of the grid; its steps give what it gave in the study, in lock-step or not."""
    experiment = plan.points[point].experiment
    if not plan.together:
        redraw = plan.redraw if recorded(experiment) else None
        return experiment.steps(seeds=sequence(plan.seed, run), redraw=redraw, named=np.inf, progress=progress)
    recording = _scene(experiment, RunSeeds(plan.seed, (run,)))
    given = experiment.tracker.given(recording)
    seeds = sequence(plan.seed, run, (1,))
    return Steps(experiment, recording, given, seeds, strict=False, progress=progress, named=np.inf)


def _scene(experiment: Experiment, seeds: RunSeeds) -> Recording:
    """Return the scene that one run in lock-step has, as a recording."""
    source = experiment.source
    scenes = (
        source.open_together(experiment.tracker.sensors, seeds.generators()) if isinstance(source, DrawsTogether) else None
    )
    if scenes is None:
        raise InputError("the study: its scenes are no longer drawn in lock-step; run it anew")
    times, first = np.unique([scan.time for scan in scenes.scans], return_index=True)
    truth = Trajectory("target", scenes.space, times, scenes.states[0, first])
    return Recording(tuple(_alone(scan) for scan in scenes.scans), (truth,))


def _alone(scan: Scan) -> Scan:
    """Return the scan of the first run, without what pads it."""
    seen = scan.detections
    kept = seen.valid[0]
    columns = {name: getattr(seen, name) for name in ("evidence", "noise", "missing", "identity")}
    return evolve(
        scan,
        detections=Detections(
            seen.z[0][kept],
            np.ones(int(kept.sum()), dtype=bool),
            **{name: None if values is None else values[0][kept] for name, values in columns.items()},
        ),
    )
