"""How a run is judged, and the resulting figures: each is declared here once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, final

import attrs
import numpy as np
from attrs import evolve, frozen

from vedette import fields
from vedette.names import look_up
from vedette.roles import MotionModel
from vedette.space import Array


@final
@frozen
class Bound:
    """What the truth is drawn from, for the posterior Cramer-Rao bound of the position."""

    motion: MotionModel = fields.part("how the objects move")
    start: dict[str, float] = fields.table(
        "axis to the standard deviation with which a state is known before its first scan"
    )
    method: str = fields.choice(
        "how failed detections enter: the information of each scan times its detection probability, or sequences of them",
        ("information_reduction", "enumeration"),
        default="information_reduction",
    )

    def __attrs_post_init__(self) -> None:
        space = self.motion.state
        if sorted(self.start) != sorted(space.names):
            raise ValueError(f"start: must give the axes {', '.join(space.names)}, got {', '.join(self.start) or 'none'}")
        if wrong := [name for name, deviation in self.start.items() if deviation < 0]:
            raise ValueError(f"start: {wrong[0]}: the standard deviation must be >= 0, got {self.start[wrong[0]]:g}")

    @property
    def covariance(self) -> Array:
        """The covariance (n, n) at an object's first scan, before it."""
        return np.diag([self.start[name] ** 2 for name in self.motion.state.names])


@final
@frozen
class Judge:
    """How tracks are judged against the truth. docs/metrics.md defines the figures."""

    cover_radius: float = fields.quantity(
        "m", "a confirmed track this near to a true object may cover it", default=50.0, above=0
    )
    gospa_cutoff: float = fields.quantity(
        "m", "c of GOSPA, OSPA and HOTA: what a wrong number of tracks costs", default=50.0, above=0
    )
    gospa_order: float = fields.quantity("1", "p of GOSPA and OSPA", default=2.0, at_least=1, at_most=10)
    switch_penalty: float | None = fields.quantity(
        "m",
        "what a track that passes to another object costs in trajectory GOSPA; default: cutoff",
        default=None,
        at_least=0,
    )
    largest_program: int = fields.integer(
        "variables of a linear program beyond which trajectory GOSPA is left out", default=100_000
    )
    ospa2_scans: int | None = fields.integer(
        "length of the window of OSPA(2) in scans; default: all of them", default=None, at_least=1
    )
    far: float | None = fields.quantity(
        "m",
        "tracks farther than this from all true objects do not count in gospa_m; default: all count",
        default=None,
        above=0,
    )
    near: float | None = fields.quantity(
        "m", "false tracks farther than this from all true objects do not count; default: all count", default=None, above=0
    )
    lost_error: float | None = fields.quantity("m", "error of a lost track; default: cover_radius", default=None, above=0)
    lost_scans: int = fields.integer(
        "scans in a row with a larger error after which a target is lost", default=5, at_least=1
    )
    offset: Array = fields.pair(
        "m", "[x, y] by which all estimates are known to be off; removed before judging", default=(0.0, 0.0)
    )
    truth_gap: float | None = fields.quantity(
        "s", "truth is interpolated over gaps of at most this; in longer ones nothing is said of the object, nor of tracks "
        "nearest to it; default: over all gaps",
        default=None, above=0,
    )  # fmt: skip
    sensor: str | None = fields.text("judge at the scans of this sensor; default: of all", default=None)
    first_scan: int = fields.integer("first scan that is judged, of this sensor's, from 0", default=0)
    last_scan: int | None = fields.integer("last scan that is judged, itself included; default: the last", default=None)

    bound: Bound | None = fields.part(
        "what the truth is drawn from, for the posterior Cramer-Rao bound; default: no bound", default=None
    )

    def __attrs_post_init__(self) -> None:
        if self.last_scan is not None and self.last_scan < self.first_scan:
            raise ValueError(f"last_scan: must be >= first_scan ({self.first_scan}), got {self.last_scan}")


Number = float | None


class Collected(Protocol):
    """What computes a plugin's figure over one run, scan block by scan block."""

    def add(self, block: Any) -> None:
        """Take some more scans of the run: a `vedette.metrics.Block`."""

    def value(self) -> Number:
        """Return the figure of all scans so far; None if there is none."""


@final
@frozen
class Figure:
    """What a figure is: its name, its unit ("1" for a pure number), a sentence, and how it sums over the runs of a study.

    sums: "mean", the mean of the runs' values, or "root", the root of the mean of their squares; study: its name in studies,
    "" if they leave it out; label: what charts of studies call it, "" if none shows it; within: the values that it can have;
    expected: the value that is right, if one is; detail: whether the text of a study leaves it out.
    start: what computes a plugin's figure, made anew for each run; the judge itself computes Vedette's own.
    """

    name: str
    unit: str
    about: str
    study: str = ""
    sums: str = "mean"
    label: str = ""
    within: tuple[float, float] = (0.0, np.inf)
    expected: float | None = None
    detail: bool = False
    start: Callable[[], Collected] | None = None

    def __attrs_post_init__(self) -> None:
        if not self.name.isidentifier():
            raise ValueError(f"figure {self.name!r}: name: must be letters, digits and _")
        if self.sums not in ("mean", "root"):
            raise ValueError(f"figure {self.name!r}: sums: must be 'mean' or 'root', got {self.sums!r}")

    @property
    def squared(self) -> bool:
        """Whether a study keeps its square, so that the mean over runs is one of squares, and reports the root."""
        return self.sums == "root"


def _of(unit: str, about: str, study: str = "", default: Any = None, **further: Any) -> Any:
    """Declare a figure on an attrs field, whose name is its name; `further` as in Figure."""
    return attrs.field(default=default, metadata={"figure": Figure("field", unit, about, study=study, **further)})


def declared(cls: type) -> tuple[Figure, ...]:
    """Return the figures that a class declares, in order."""
    fields_of = attrs.fields(cls)
    return tuple(evolve(field.metadata["figure"], name=field.name) for field in fields_of if "figure" in field.metadata)


@frozen
class TruthScore:
    """The figures of one true object over the `scans` judged while it existed; None where a figure does not exist.

    coverage: fraction of those scans; confirmed_after_s: from the first of them to the first in which it was covered
    """

    name: str
    scans: int
    coverage: Number = _of("1", "coverage")
    position_rmse_m: Number = _of("m", "position error")
    id_switches: int = _of("1", "identity switches", default=0)
    lost: bool | None = None
    confirmed_after_s: Number = _of("s", "first covered")


_SHARE = (0.0, 1.0)


@frozen
class Score:
    """The figures of one run, as docs/metrics.md defines them; None where there is none, as without truth or tracks.

    `more`: those that plugins bring, by name; `figures` leaves out those that this run has not.
    """

    scans: int = _of("1", "scans that were judged", default=attrs.NOTHING)
    tracks: int = _of("1", "tracks that were ever confirmed", default=attrs.NOTHING)
    position_rmse_m: Number = _of(
        "m", "position error, RMS while covered", "position_rmse", sums="root", label="RMS position error [m]"
    )
    position_deviation_m: Number = _of("m", "position error that the covariances expect")
    velocity_rmse_mps: Number = _of("m/s", "velocity error, RMS while covered", "velocity_rmse", sums="root")
    bias_m: tuple[float, ...] | None = _of("m", "mean error")
    nees_position: Number = _of("1", "NEES of the position over what is expected", expected=1.0)
    nees_state: Number = _of("1", "NEES of the state over what is expected", "nees", label="NEES per axis", expected=1.0)
    nees_state_axes: tuple[str, ...] | None = None
    nis: Number = _of("1", "NIS over what is expected", "nis", label="NIS over what is expected", expected=1.0)
    mode_prob: tuple[float, ...] | None = _of("1", "mean mode probability")
    lost: Number = _of("1", "part of the objects that are lost", "lost", label="share of lost runs", within=_SHARE)
    coverage: Number = _of(
        "1", "part of the scans in which an object is covered", "coverage", label="share of time covered", within=_SHARE
    )
    id_switches: int | None = _of("1", "identity switches", "id_switches")
    false_tracks: Number = _of(
        "1", "confirmed tracks that cover nothing, at a time", "false_tracks", label="false tracks at a time"
    )
    gospa_m: Number = _of("m", "GOSPA, without tracks far from all objects", "gospa", label="GOSPA [m]")
    gospa_localisation: Number = _of("m^p", "GOSPA's part from errors")
    gospa_missed: Number = _of("m^p", "GOSPA's part from objects without a track")
    gospa_false: Number = _of("m^p", "GOSPA's part from tracks without an object")
    gospa_all_m: Number = _of("m", "GOSPA of all confirmed tracks")
    ospa_m: Number = _of("m", "OSPA", "ospa")
    confirmed_after_s: Number = _of("s", "wait until an object is first covered", "confirmed_after")
    trajectory_gospa_m: Number = _of("m", "trajectory GOSPA a scan", "trajectory_gospa")
    trajectory_gospa_localisation: Number = _of("m^p", "its part from errors")
    trajectory_gospa_missed: Number = _of("m^p", "its part from objects without a track")
    trajectory_gospa_false: Number = _of("m^p", "its part from tracks without an object")
    trajectory_gospa_switches: Number = _of("m^p", "its part from identity switches")
    ospa2_m: Number = _of("m", "OSPA(2) of whole tracks", "ospa2", detail=True)
    mota: Number = _of("1", "MOTA", "mota")
    motp_m: Number = _of("m", "MOTP, mean distance of covered objects", "motp", detail=True)
    idf1: Number = _of("1", "IDF1, identities kept over the whole run", "idf1", detail=True)
    hota: Number = _of("1", "HOTA", "hota")
    hota_detection: Number = _of("1", "HOTA's part of detection", "hota_detection", detail=True)
    hota_association: Number = _of("1", "HOTA's part of association", "hota_association", detail=True)
    hota_localisation: Number = _of("1", "HOTA's part of localisation")
    siap_completeness: Number = _of("1", "SIAP completeness", "siap_completeness", detail=True)
    siap_ambiguity: Number = _of("1", "SIAP ambiguity", "siap_ambiguity", detail=True)
    siap_spuriousness: Number = _of("1", "SIAP spuriousness", "siap_spuriousness", detail=True)
    siap_position_m: Number = _of("m", "SIAP position error", "siap_position", detail=True)
    siap_velocity_mps: Number = _of("m/s", "SIAP velocity error")
    siap_changes_per_s: Number = _of("1/s", "SIAP identity switches", "siap_changes", detail=True)
    siap_longest: Number = _of("1", "SIAP longest track, part of a life", "siap_longest", detail=True)
    position_bound_m: Number = _of("m", "Cramer-Rao bound of the position error", "position_bound", sums="root")
    more: dict[str, Number] = attrs.field(factory=dict)
    truths: tuple[TruthScore, ...] = ()

    def _repr_html_(self) -> str:
        return str(look_up("score_html")(self))

    def figures(self) -> dict[str, Any]:
        """Return plain numbers, tuples and tables by name, as JSON takes them; nothing is NaN."""
        told = attrs.asdict(self)
        more, truths = told.pop("more"), told.pop("truths")
        return told | {name: value for name, value in more.items() if value is not None} | {"truths": truths}


FIGURES = declared(Score)
"""The figures of a run, in the order in which they are told."""

OF_OBJECTS = declared(TruthScore)
"""The figures of each true object."""
