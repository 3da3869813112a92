"""What outputs and the store are told: the tracks of a state."""

from __future__ import annotations

from typing import Any

from attrs import evolve

from vedette.space import Array
from vedette.streams import TrackReport
from vedette.tracking import State
from vedette_files import east_north
from vedette_live.config import Service


def report_of(service: Service, state: State) -> TrackReport:
    """Return the tracks of a state."""
    tracker, origin = service.experiment.tracker, service.parts.service.origin
    ground = east_north(service.parts.service.frame)
    estimate = tracker.estimate(state)
    geodetic = None
    if origin is not None:
        names = [axis.name for axis in tracker.state.axes]
        places = [names.index(name) for name in (*ground, "z") if name in names]

        def geodetic(mean: Array) -> tuple[Array, Array, Array]:
            east, north, *up = (mean[..., k] for k in places)
            return origin.from_plane(east, north, up[0] if up else None)

    known = (state.ids, estimate.mean, estimate.cov, state.existence, state.confirmed)
    return TrackReport(state.steps, state.time, tracker.state, *known, geodetic, ground)


def chosen(report: TrackReport, rows: Any) -> TrackReport:
    """Return some tracks of a report."""
    return evolve(
        report,
        ids=report.ids[rows],
        mean=report.mean[rows],
        cov=report.cov[rows],
        existence=report.existence[rows],
        confirmed=report.confirmed[rows],
    )
