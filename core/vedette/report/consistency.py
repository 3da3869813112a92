"""Errors against covariances over time: the picture of a tracker's consistency."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from attrs import frozen

from vedette.report import canvas
from vedette.space import Array


@frozen(eq=False)
class Shown:
    """What is drawn: figures at `times` (s,), 1 expected of each, with the bands of one point if they are exact."""

    consistent: bool
    runs: int
    alpha: float
    exact: bool
    times: Array
    nees: Array
    nees_band: tuple[float, float]
    nis: Mapping[str, Array]
    directions: tuple[str, ...]
    calibration: Array
    calibration_band: tuple[float, float]


def draw(report: Shown, path: Path) -> None:
    """Write a PNG: NEES, NIS and the scale of the covariance along each direction, 1 expected, each with its band."""
    made = canvas.figure(8.0)
    top, low = made.subplots(2, 1, sharex=True)
    verdict = "consistent" if report.consistent else "not consistent"
    canvas.head(made, f"The tracker is {verdict}", f"{report.runs} runs, false-alarm rate {report.alpha:g} in all")
    top.plot(report.times, report.nees, color=canvas.colour(0), label="NEES")
    for i, (name, values) in enumerate(report.nis.items(), 1):
        top.plot(report.times, values, color=canvas.colour(i), linewidth=1, label=f"NIS of {name}")
    for i, (name, values) in enumerate(zip(report.directions, report.calibration, strict=True)):
        low.plot(report.times, values, color=canvas.colour(i), linewidth=1.2, label=name)
    for axes, band, label in (
        (top, report.nees_band, "over what is expected"),
        (low, report.calibration_band, "squared error over variance"),
    ):
        axes.axhline(1.0, color=canvas.INK, linewidth=0.8)
        if report.exact:
            axes.axhspan(*band, color=canvas.FAINT, alpha=0.6, label="band")
        axes.set_ylabel(label)
        axes.legend(loc="upper right", ncols=4, fontsize=9)
        canvas.plain(axes)
    low.set_xlabel("time [s]")
    canvas.save(made, path)
