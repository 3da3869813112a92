"""How a run is judged, and the resulting figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import attrs
import numpy as np
from attrs import frozen

from vedette import fields
from vedette.display import figures_html
from vedette.metrics.bound import Bound
from vedette.metrics.coverage import Indices
from vedette.space import Array
from vedette.types import Scan


def _two(values: Array) -> str | None:
    return None if len(values) == 2 else f"must be [x, y], got {len(values)} numbers"


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
    offset: Array = fields.array(
        "m",
        "[x, y] by which all estimates are known to be off; removed before judging",
        ndim=1,
        default=(0.0, 0.0),
        check=_two,
    )
    truth_gap: float | None = fields.quantity(
        "s", "the truth is interpolated over gaps of at most this, and unknown in longer ones; default: over all gaps",
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

    def choose(self, scans: Sequence[Scan]) -> Indices:
        """Return the indices of the scans that are judged."""
        own = [i for i, scan in enumerate(scans) if self.sensor in (None, scan.sensor)]
        end = None if self.last_scan is None else self.last_scan + 1
        return np.array(own[self.first_scan : end], dtype=np.intp)


@frozen
class TruthScore:
    """The figures of one true object over the `scans` judged while it existed; None where a figure does not exist.

    coverage: fraction of those scans; confirmed_after_s: from the first of them to the first in which it was covered
    """

    name: str
    scans: int
    coverage: float | None
    position_rmse_m: float | None
    id_switches: int
    lost: bool | None
    confirmed_after_s: float | None


@frozen
class Score:
    """The figures of one run, as docs/metrics.md defines them; None where there is none, as without truth or tracks."""

    scans: int
    tracks: int
    position_rmse_m: float | None = None
    position_deviation_m: float | None = None
    velocity_rmse_mps: float | None = None
    bias_m: tuple[float, ...] | None = None
    coverage: float | None = None
    id_switches: int | None = None
    false_tracks: float | None = None
    lost: float | None = None
    confirmed_after_s: float | None = None
    gospa_m: float | None = None
    gospa_localisation: float | None = None
    gospa_missed: float | None = None
    gospa_false: float | None = None
    gospa_all_m: float | None = None
    ospa_m: float | None = None
    trajectory_gospa_m: float | None = None
    trajectory_gospa_localisation: float | None = None
    trajectory_gospa_missed: float | None = None
    trajectory_gospa_false: float | None = None
    trajectory_gospa_switches: float | None = None
    ospa2_m: float | None = None
    mota: float | None = None
    motp_m: float | None = None
    hota: float | None = None
    hota_detection: float | None = None
    hota_association: float | None = None
    hota_localisation: float | None = None
    siap_completeness: float | None = None
    siap_ambiguity: float | None = None
    siap_spuriousness: float | None = None
    siap_position_m: float | None = None
    siap_velocity_mps: float | None = None
    siap_changes_per_s: float | None = None
    siap_longest: float | None = None
    position_bound_m: float | None = None
    nees_position: float | None = None
    nees_state: float | None = None
    nees_state_axes: tuple[str, ...] | None = None
    nis: float | None = None
    mode_prob: tuple[float, ...] | None = None
    truths: tuple[TruthScore, ...] = ()

    def _repr_html_(self) -> str:
        own = {name: getattr(self, name) for name in attrs.fields_dict(type(self)) if name != "truths"}
        title = f"Score over {self.scans} scans"
        each = "".join(figures_html(truth.name, attrs.asdict(truth)) for truth in self.truths)
        return figures_html(title, own) + each

    def figures(self) -> dict[str, Any]:
        """Return plain numbers, tuples and tables by name, as JSON takes them; nothing is NaN."""
        return attrs.asdict(self)
