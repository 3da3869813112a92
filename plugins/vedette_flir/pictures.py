"""The figures of the infrared paper, drawn anew, and the errors beside their bound."""

from __future__ import annotations

import numpy as np

from vedette import Array
from vedette_flir.matched_truth import FRAMES, RATE, SETTLED, Record, bound
from vedette_flir.verdicts import Found, Varied
from vedette_report.findings import Chart, Claim, Curve, Panel
from vedette_study.panels import over_runs

CHANNELS = ("X-channel dynamics", "Y-channel dynamics", "X-channel atmospheric", "Y-channel atmospheric")
"""The paper's four figures; it prints neither scales nor parameters, so there is nothing to mark."""


def charts(found: Found, varied: Varied, claims: tuple[Claim, ...]) -> tuple[Chart, ...]:
    """Return the paper's four figures, and the errors against the signal-to-noise ratio beside the bound."""
    times = np.arange(SETTLED, FRAMES) / RATE
    paper = varied["wander"]["three passes"]
    parts = [(paper.dynamics, 0), (paper.dynamics, 1), (paper.jitter, 0), (paper.jitter, 1)]
    panels = tuple(
        Panel(f"{name} error", "time [s]", "error [px]", _channel(part[..., i], times, paper.sigma[:, k]))
        for k, (name, (part, i)) in enumerate(zip(CHANNELS, parts, strict=True))
    )
    return (
        Chart(
            "errors",
            "Errors of the paper's filter, with three passes; the paper prints curves without scales",
            panels,
            claims,
            shared=True,
        ),
        Chart(
            "bounds",
            "RMS error of dynamics and jitter together, runs lost left out; bars: two standard errors",
            _bounds(found),
            claims[:2],
            shared=True,
        ),
    )


def _channel(error: Array, times: Array, sigma: Array) -> tuple[Curve, ...]:
    root, doubt = over_runs(error**2)
    return (
        Curve("one run", times, error[0]),
        Curve("root mean square over runs; band: two standard errors", times, root, doubt=doubt),
        Curve("standard deviation that the filter states", times, sigma, "dashed"),
    )


def _bounds(found: Found) -> tuple[Panel, ...]:
    panels = []
    for jitter, spread in dict.fromkeys((case[0], case[1]) for case in found):
        cases = [case for case in found if case[:2] == (jitter, spread)]
        snr = np.array([case[2] for case in cases])
        curves = [Curve("bound", snr, np.array([bound(spread, case[2], jitter)[2] for case in cases]), "dashed")]
        for name in found[cases[0]]:
            figures = np.array([_error(found[case][name]) for case in cases]).T
            curves.append(Curve(name, snr, figures[0], "points", doubt=2 * figures[1]))
        title = f"Jitter {jitter:g} px, spread {spread:g} px"
        panels.append(Panel(title, "signal-to-noise ratio", "RMS error [px]", tuple(curves), log=True, log_across=True))
    return tuple(panels)


def _error(seen: Record) -> tuple[float, float]:
    """Return the root mean square error of the sum over the runs kept, and its standard error; NaN if none was."""
    squares = np.mean(seen.apparent[~seen.lost] ** 2, axis=(1, 2))
    if len(squares) < 2:
        return np.nan, 0.0
    root = float(np.sqrt(np.mean(squares)))
    return root, 0.5 * float(np.std(squares, ddof=1) / np.sqrt(len(squares))) / root
