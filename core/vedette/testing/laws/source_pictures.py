"""Laws of sources that give pictures: where targets are, and how what is beside them varies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from vedette.space import Array
from vedette.supporting import Source
from vedette.testing.bands import judge_run_means
from vedette.testing.comparisons import Closed, Unlike, closed_if, demand
from vedette.testing.law import Law
from vedette.testing.laws.source import OPENINGS, Opened, told
from vedette.types import Recording

BESIDE = 12.0
"""Pixels from a target from which on there is nothing but background."""


def pictured(recording: Recording) -> Iterator[tuple[float, Array, list[dict[str, float]]]]:
    """Yield each picture's time, its pixels, and what is known of each target with truth in px, x and y in this picture."""
    paths = [path for path in recording.truth if {("x", "px"), ("y", "px")} <= {(a.name, a.unit) for a in path.space.axes}]
    for scan in recording.scans:
        if scan.frame is None:
            raise Unlike("its scans are no pictures")
        corner, known = np.zeros(2) if scan.frame.corner is None else scan.frame.corner, []
        for path in paths:
            if (state := path.at(scan.time)) is not None:
                named = dict(zip(path.space.names, state.tolist(), strict=True))
                at = {axis: named[axis] + named.get(f"j{axis}", 0.0) - corner[i] for i, axis in enumerate("xy")}
                known.append(named | at)
        yield scan.time, told(scan), known


def distance(pixels: Array, target: Mapping[str, float]) -> Array:
    """Return how far each pixel is from a target, (h, w)."""
    rows, columns = np.indices(pixels.shape[-2:])
    return np.asarray(np.hypot(columns - target["x"], rows - target["y"]))


def pictures_show_the_truth(source: Source, drawn: Opened) -> None:
    """If it gives pictures and truth in px: where a target is, counted from the corner, pixels differ from the others.

    If the truth has `width` and `height`: what stands out is .3 to 1.4 times as wide and high.
    """
    contrast: list[float] = []
    sizes: list[Array] = []
    for _, pixels, targets in pictured(drawn.open(source)):
        for target in targets:
            near = distance(pixels, target) < 1.5
            rest = pixels[..., ~near]
            if not near.any() or not np.isfinite(pixels[..., near]).any():
                continue
            spread, usual = float(np.nanstd(rest)) + 1e-9, np.nanmean(rest)
            light = np.abs(np.nan_to_num(pixels - usual))
            if light.max() < 6.0 * spread:
                continue  # nothing stands out
            contrast.append((float(np.nanmean(pixels[..., near])) - float(usual)) / spread)
            box = np.array([target.get("width", np.nan), target.get("height", np.nan)])
            at, end = np.array([target["x"], target["y"]]), np.array(pixels.shape[:-3:-1])
            whole = len(targets) == 1 and pixels.ndim == 2 and np.isfinite(pixels).mean() > 0.9
            if whole and np.all((at > box) & (at < end - box)):
                bright = light > 0.5 * light.max()
                if light.max() > 20.0 * np.median(light):  # no noise is so bright
                    sizes.append(np.array([np.ptp(np.flatnonzero(bright.any(axis=axis))) + 1 for axis in (0, 1)]) / box)
    closed_if(not contrast, "no target is within a picture with truth in px, or none stands out")
    mean = float(np.mean(contrast))
    demand(abs(mean) > 1.0, f"frame: at the truth pixels must differ, are {mean:.3g} deviations from the others on average")
    for name, ratio in zip(("width", "height"), np.median(sizes, axis=0) if sizes else (), strict=False):
        demand(0.3 < ratio < 1.4, f"truth: what stands out is {ratio:.3g} times as large as its {name}, must be .3 to 1.4")


def _beside(source: Source, drawn: Opened) -> Iterator[list[tuple[float, Array]]]:
    """Yield for some openings each picture's time, and its pixels less the `level`, NaN where a target is near."""
    level, parts = getattr(source, "level", None), [getattr(source, name, 0.0) for name in ("sigma", "clutter")]
    if not isinstance(level, float) or not all(isinstance(part, float) for part in parts) or not any(parts):
        raise Unlike("it has no `sigma` and `level`, or nothing varies")
    for k in range(OPENINGS):
        found = []
        for time, pixels, targets in pictured(drawn.again(k).open(source)):
            near = np.any([distance(pixels, target) <= BESIDE for target in targets], axis=0)
            found.append((time, np.where(near, np.nan, pixels - level)))
        yield found


def pictures_vary_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `sigma` and `level` in counts, and perhaps `clutter`: so pixels vary beside the targets, and around that."""
    squares = [np.array([pixels for _, pixels in each]) ** 2 for each in _beside(source, drawn)]
    closed_if(not all(np.isfinite(each).any() for each in squares), "no pixel is beside its targets")
    stated = np.sum(np.square([getattr(source, name, 0.0) for name in ("sigma", "clutter")]))
    ratios = np.array([np.nanmean(each) for each in squares]) / stated
    judge_run_means("variance of pixels", ratios, 0.6, 1.6, drawn.alpha / 20)


def backgrounds_drift_as_stated(source: Source, drawn: Opened) -> None:
    """If it has `clutter`, `clutter_time` and `drift`: a background is the one before, moved by the drift, that fades.

    What is new in it has the variance clutter^2 (1 - keep^2), keep = exp(-dt / clutter_time), beside that of the noise.
    """
    clutter, time, drift = (getattr(source, name, None) for name in ("clutter", "clutter_time", "drift"))
    if not clutter or time is None or drift is None:
        raise Closed("it has no `clutter` with `clutter_time` and `drift`")
    sigma, ratios = getattr(source, "sigma", 0.0), []
    for pictures in _beside(source, drawn):
        for (begin, one), (end, other) in pairwise(pictures):
            move, keep = np.multiply(end - begin, drift), np.exp((begin - end) / time)
            step, edge = np.round(move).astype(int), int(np.ceil(np.max(np.abs(move)))) + 1
            closed_if(np.any(np.abs(move - step) > 0.01), "it does not drift by whole pixels")
            new = (other - keep * np.roll(one, step[::-1], axis=(0, 1)))[edge:-edge, edge:-edge]
            closed_if(np.isfinite(new).sum() < 200, "few pixels are beside its targets")
            ratios.append(np.nanmean(new**2) / (clutter**2 * (1 - keep**2) + sigma**2 * (1 + keep**2)))
    judge_run_means("variance of what is new in a picture", np.array(ratios), 0.95, 1.05, drawn.alpha / 20)


LAWS = (Law(pictures_show_the_truth), Law(pictures_vary_as_stated, share=2), Law(backgrounds_drift_as_stated))
