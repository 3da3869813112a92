"""Drawn frames, the tracker of examples/flir_clip.toml on them, and a filter and its search by themselves."""

import numpy as np

import vedette
from support.paths import EXAMPLES
from support.spots import gaussian
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators.template import TemplateFilter
from vedette_flir.estimators.template_search import Matcher
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.image_velocity import ImageVelocity

SIZE, PEAK, SPREAD = (120, 240), 60.0, (2.0, 2.0)
"""Rows and columns, counts, and px: of a frame and of the spot in it; its box is `BOX`."""
BOX, BY = np.array([10.0, 10.0]), Matcher(36, 0.3, 1.6, 2.5, 40.0)
FILTER = TemplateFilter(Carrying(ImageVelocity(), {"width": "px", "height": "px"}))


def land(k, spots, turn, size, seed, *, texture=5.0, below=0.0, scale=1.0):
    """Frame k of a land that a camera passes by `turn` px a frame, and spots in it: place, peak and spread of each.

    It is brighter by `below` for each px further down; the frame is `scale` times as large as `size`.
    """
    rows, columns = (round(scale * side) for side in size)
    y, x = (axis / scale + k * by for axis, by in zip(np.ogrid[:rows, :columns], turn[::-1], strict=True))
    pixels = 60.0 + below * y + texture * (np.sin(x / 6.0) * np.cos(y / 5.0) + 0.8 * np.sin(0.31 * x + 0.23 * y))
    shown = [peak * gaussian(x, y, at, spread) for at, peak, spread in spots]
    return pixels + np.max(shown, axis=0) + np.random.default_rng([seed, k]).normal(0.0, 1.0, (rows, columns))


def steps(frames, boxes, *overrides, times=None):
    """Yield state and estimate after each frame, by default 30 in a second, of targets in boxes: x, y, width, height."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml", overrides=overrides).tracker
    names, given = list(tracker.state.names), {"x": 1.0, "y": 1.0, "vx": 100.0, "vy": 100.0, "width": 0.0, "height": 0.0}
    mean, cov = np.zeros((len(boxes), len(names))), np.diag([given[name] ** 2 for name in names])
    mean[:, [names.index(name) for name in ("x", "y", "width", "height")]] = boxes
    state = tracker.start(Gaussian(mean, np.repeat(cov[None], len(boxes), 0)), 0.0 if times is None else times[0])
    for k, pixels in enumerate(frames):
        state = tracker.step(state, Scan.image(k / 30 if times is None else times[k], "camera", Frame(pixels)))
        yield state, tracker.estimate(state)


def followed(frames, box, *overrides):
    """Return existence (s,) and place (s, 2) of one target after each frame."""
    rows = [(state.existence[0], *estimate.mean[0, :2]) for state, estimate in steps(frames, [box], *overrides)]
    table = np.array(rows)
    return table[:, 0], table[:, 1:]
