"""Laws of preprocessors that read pictures: what stands out makes returns, and noise as few as stated."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve
from scipy.special import ndtri

from vedette.errors import VedetteError
from vedette.supporting import ImagingSensor, Preprocessor
from vedette.testing.comparisons import Closed, Unlike, covariance, demand, frozen_copy, same, stated, varied
from vedette.testing.law import Law
from vedette.testing.laws.preprocessor_cases import Raw, made_of
from vedette.types import Detections, Frame, Pose, Scan

RARE, CELLS = 2e-4, 6000
"""Rate of false alarms that is tried, and cells of a row of noise: 1.2 of them are expected in it."""


def pictures_make_returns(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it reads pictures: a spot that stands out of noise, bright or dark, makes a return, elsewhere with the picture."""
    if not any(isinstance(sensor, ImagingSensor) for sensor in preprocessor.sensors.values()):
        raise Unlike("it reads no pictures")
    ((name, _),) = preprocessor.sensors.items()
    lit = np.random.default_rng(len(drawn.scans[name].detections.z)).exponential(1.0, (60, 160))
    lit[20:23, 100] = lit[37:40, 55] = 1e5

    def made(pixels: Any, x: float = 0.0, y: float = 0.0, posed: bool = True) -> Detections:
        place = np.array([x, y])
        frame, pose = Frame(frozen_copy(pixels), place), Pose(place, heading=np.pi / 2)
        return made_of(preprocessor, {name: evolve(Scan.image(5.0, name, frame), pose=pose if posed else None)})

    screen = np.minimum(lit, 255.0).astype(np.uint8)
    refused = ""
    for pictures in ((lit, lit.max() - lit), (np.stack([screen] * 3),), (screen,)):
        try:
            each = [made(pixels) for pixels in pictures]
            break
        except VedetteError as refusal:
            refused = str(refusal)
    else:
        raise Closed(f"it refuses the kit's pictures: {refused}")
    found = [i for i, one in enumerate(each) if len(one.z)]
    demand(found, f"returns: must be some of a {pictures[0].dtype} picture with a spot in noise, got none")
    shown, some = pictures[found[0]], each[found[0]]
    if some.noise is not None:
        covariance("noise of a return of a picture", some.noise, definite=True)
    moved = np.zeros(some.z.shape[-1])
    for i, axis in enumerate(preprocessor.measurement.axes):
        moved[i] = {"x": 40.0, "y": -30.0}.get(axis.name, 0.0)
    same("returns of a picture that is elsewhere", made(shown, 40.0, -30.0).z, some.z + moved, 1e-9)
    same("returns of a picture without a pose", made(shown, posed=False).z, some.z, 1e-9)


def false_alarms_are_as_rare_as_stated(preprocessor: Preprocessor, drawn: Raw) -> None:
    """If it reads pictures and has a `rate` of false alarms: so many cells of noise make a return, or fewer near the ends.

    Noise is exponential power, as of a receiver. The window may take up to 3,072 cells of a row of 6,000.
    """
    if not all(isinstance(sensor, ImagingSensor) for sensor in preprocessor.sensors.values()):
        raise Unlike("it reads no pictures")
    stated(preprocessor, "rate", "1")
    ((name, _),) = preprocessor.sensors.items()
    often = varied(preprocessor, rate=RARE)
    rng = np.random.default_rng(drawn.seed)
    rows = drawn.runs // 2
    noise = rng.exponential(rng.uniform(0.5, 2.0), (rows, 1, CELLS))
    found = sum(len(made_of(often, {name: Scan.image(5.0, name, Frame(frozen_copy(row)))}).z) > 0 for row in noise)
    low, high = (rows * -np.expm1(-RARE * CELLS * share) for share in (0.4, 1.0))
    reach = -ndtri(drawn.alpha / 2) * np.sqrt(rows) / 2
    told = f"returns: {found} of {rows} rows of {CELLS} cells of noise make some; by `rate`, {high:.0f} do"
    demand(low - reach <= found <= high + reach, told)


LAWS = (Law(pictures_make_returns, share=4), Law(false_alarms_are_as_rare_as_stated, effort="statistical"))
