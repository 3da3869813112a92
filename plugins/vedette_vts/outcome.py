"""What the study of the vessel traffic radar reports: its tables and the data of its figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Mask, Scan
from vedette_report.findings import Chart, Claim, Curve, Panel, Table, mean_cell, rms_cell, share_cell
from vedette_study.panels import comparison, mean_over_runs, mode_panel, over_runs
from vedette_vts.configs import LEGS, MODES

SETTLED = 20
"""Scans at the start that no figure counts, while the filters settle."""
GATE = 13.815510557964274
"""Squared distance that holds .999 of a target's returns: -2 log .001."""


@frozen(eq=False)
class Scene:
    """times (s,), truth (s, 4), and the tracker's input: scans whose arrays lead with the runs."""

    times: Array
    truth: Array
    scans: tuple[Scan, ...]

    @property
    def squares(self) -> Array:
        """Squared errors of the returns (r, s)."""
        spots = np.concatenate([scan.detections.z for scan in self.scans], axis=1)
        return np.sum((spots - self.truth[:, :2]) ** 2, axis=-1)


@frozen(eq=False)
class Record:
    """One filter, from the third scan on: squares, distance, nis, nees (r, s-2), lost (r,).

    path (s-2, 2): its track in the first run; modes and modes_doubt (s-2, q): mean mode
    probabilities and two standard errors of them, None without modes.
    """

    squares: Array
    distance: Array
    nis: Array
    nees: Array
    lost: Mask
    path: Array
    modes: Array | None
    modes_doubt: Array | None = None


def leg(name: str) -> slice:
    """Return the scans of a leg among those that a record holds, without the settling ones."""
    first, past = LEGS[name]
    return slice(max(first, SETTLED) - 2, past - 2)


MANOEUVRES = slice(LEGS["turn 1"][0] - 2, LEGS["turn 2"][1] - 2)


def tables(scene: Scene, records: Mapping[str, Record]) -> tuple[Table, ...]:
    """Return errors by leg, the in-gate record, and how large the errors are against the covariances."""
    raw = scene.squares[:, 2:]
    squares = {"returns": raw} | {name: record.squares for name, record in records.items()}
    errors = Table(
        "RMS distance error by leg",
        tuple(LEGS),
        tuple((name, tuple(rms_cell(part[:, leg(where)]) for where in LEGS)) for name, part in squares.items()),
        "m; the filter takes every return, in its gate or not; CV2 holds the recovery from turn 2. The paper has curves.",
    )
    return errors, _gates(records), _consistency(records)


def _gates(records: Mapping[str, Record]) -> Table:
    rows = []
    for name, record in records.items():
        out = record.distance > GATE
        straight, turning = (share_cell(out[:, part], scale=100) for part in (leg("CV1"), MANOEUVRES))
        mixture = share_cell(record.nis[:, MANOEUVRES] > GATE, scale=100)
        rows.append((name, (straight, turning, mixture, share_cell(record.lost, scale=100))))
    return Table(
        "Returns outside the gate, and runs lost",
        ("CV1", "manoeuvres", "manoeuvres, mean gate", "runs lost"),
        tuple(rows),
        "%; the gate holds .999 of a target's returns by the filter's own reckoning (13.8); an IMM's is the union over its "
        "modes; the mean gate takes the distance expected over modes. Lost: more than 200 m off at the end where only "
        "returns inside the gate are taken.",
    )


def _consistency(records: Mapping[str, Record]) -> Table:
    rows = [
        (
            name,
            tuple(
                mean_cell(np.mean(values[:, part], axis=1))
                for values in (record.nees, record.nis)
                for part in (leg("CV1"), MANOEUVRES)
            ),
        )
        for name, record in records.items()
    ]
    return Table(
        "Squared errors over their covariances",
        ("NEES CV1", "NEES manoeuvres", "NIS CV1", "NIS manoeuvres"),
        tuple(rows),
        "a filter whose model is the truth has 4 (NEES, position and velocity) and 2 (NIS); here none has",
    )


def charts(scene: Scene, records: Mapping[str, Record], errors: Table, claims: tuple[Claim, ...]) -> tuple[Chart, ...]:
    """Return the paper's figures 2 to 6, the errors by leg, and the mode probabilities."""
    scans = 1.0 + np.arange(len(scene.times))
    returned = Curve("returns", scans[2:], np.sqrt(np.mean(scene.squares[:, 2:], axis=0)), "dots")
    against_time, gates = [], []
    for name, record in records.items():
        root, doubt = over_runs(record.squares)
        curves = (returned, Curve("track", scans[2:], root, doubt=doubt))
        against_time.append(Panel(name, "scan (3 s each)", "RMS error [m]", curves, log=True))
        out = record.distance > GATE
        share, doubt = (100 * part for part in mean_over_runs(out.astype(float)))
        curve = Curve("", scans[2:], share, doubt=doubt)
        gates.append(Panel(name, "scan (3 s each)", "outside the gate [%]", (curve,), within=(0.0, 100.0)))
    gated = tuple(claim for claim in claims if "gate" in claim.text)
    return (
        Chart("trajectory", "The vessel, and what the radar saw of it (figure 2)", (_plane(scene, records["IMMCVCA"]),)),
        Chart(
            "errors",
            "RMS position error against time; bands: two standard errors (figures 3 to 6)",
            tuple(against_time),
            claims,
            shared=True,
        ),
        Chart(
            "gates",
            "Runs whose return is outside the gate; scales differ; bands: two standard errors (figures 3 to 6)",
            tuple(gates),
            gated,
        ),
        Chart(
            "legs",
            "RMS position error by leg; bars: two standard errors; the paper prints curves of one run",
            (_by_leg(errors),),
            claims[-1:],
        ),
        Chart(
            "modes",
            "Mode probabilities of the IMMs, mean over runs; bands: two standard errors",
            _modes(scans, records),
            shared=True,
        ),
    )


def _by_leg(errors: Table) -> Panel:
    """Return the errors by leg, with the legs' names written out."""
    panel = comparison(errors, tuple(LEGS), "RMS error [m]", log=True)
    written = {"CV1": "straight before", "accel": "accelerations", "CV2": "straight after"}
    return evolve(panel, curves=tuple(evolve(curve, label=written.get(curve.label, curve.label)) for curve in panel.curves))


def _plane(scene: Scene, record: Record) -> Panel:
    raw = np.concatenate([scan.detections.z[0] for scan in scene.scans]) / 1e3
    truth, track = scene.truth / 1e3, record.path / 1e3
    curves = (
        Curve("radar returns", raw[:, 0], raw[:, 1], "dots"),
        Curve("truth", truth[:, 0], truth[:, 1]),
        Curve("IMMCVCA", track[:, 0], track[:, 1], "dashed"),
        Curve("", truth[:1, 0], truth[:1, 1], "points", 1, notes=("start",)),
        Curve("", np.zeros(1), np.zeros(1), "points", 0, notes=("radar",)),
    )
    return Panel("One run", "x [km]", "y [km]", curves, equal=True)


def _modes(scans: Array, records: Mapping[str, Record]) -> tuple[Panel, ...]:
    return tuple(
        mode_panel(name, "scan (3 s each)", scans[2:], record.modes, MODES[name], record.modes_doubt)
        for name, record in records.items()
        if record.modes is not None
    )
