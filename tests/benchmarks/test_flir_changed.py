"""Changed clips keep their labels: what stands out is where they say, and the example follows it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import flir_changed as changed
from benchmarks import flir_clips as clips
from vedette import Array

PLANTED = ("trees", "crosses", "halts")


def drawn(count: int) -> tuple[Array, dict[int, Array]]:
    """Frames of 96 x 120 px with a spot that flies over a slope, and its boxes."""
    (y, x), boxes = np.mgrid[:96, :120], {k: np.array([40.0 + 0.7 * k, 50.0 - 0.3 * k, 10.0, 8.0]) for k in range(count)}
    spots = [100.0 * np.exp(-0.5 * (((x - b[0]) / 2.5) ** 2 + ((y - b[1]) / 2.0) ** 2)) for b in boxes.values()]
    noise = np.random.default_rng(4).normal(0.0, 1.0, (count, 96, 120))
    return np.clip(np.rint(60.0 + 0.2 * x + spots + noise), 0, 255).astype(np.uint8), boxes


CHANGES = [kind for kind in changed.CHANGES if kind not in PLANTED]


@pytest.mark.parametrize("kind", CHANGES)
@pytest.mark.by_turns
def test_labels_stay_right(kind: str) -> None:
    new = changed.CHANGES[kind](*drawn(20), np.random.default_rng(1))
    if kind == "turned 4":
        assert np.ptp([box[0] for box in new.boxes.values()]) > 0
    for k, box in new.boxes.items():
        low, high = (np.rint(box[:2] + sign * 0.5 * box[2:]).astype(int) for sign in (-1, 1))
        part = new.frames[k][low[1] : high[1] + 1, low[0] : high[0] + 1].astype(float)
        excess = np.abs(part - np.median(new.frames[k]))
        excess = np.maximum(excess - 0.5 * excess.max(), 0.0)
        middle = (
            low
            + [excess.sum(axis=0) @ np.arange(part.shape[1]), excess.sum(axis=1) @ np.arange(part.shape[0])] / excess.sum()
        )
        assert np.abs(middle - box[:2]).max() < 1.5 * new.scale
    clip = clips.Clip("drawn", new.frames, new.boxes, ())
    one = changed.in_recorded_px(clips.follow(clips.tracker(), clip, 0, len(new.frames), rate=new.rate), new.scale)
    assert np.nanmax(one.error) < 3.0
    assert not one.doubted.any()
