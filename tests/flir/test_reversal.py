"""A target that is brighter than the sky is darker than a cloud: it is held there, and no dark thing is taken for it."""

import numpy as np
import pytest

from support import infrared
from support.spots import gaussian
from vedette_flir.estimators import judged, template

SIZE, FRAMES = (70, 190), 72
pytestmark = pytest.mark.costly


def path(k):
    return np.array([40.0 + 1.2 * k, 35.0])


def perched(k):
    return np.array([60.0, 35.0])


def drawn(k, cloud, dark, shown, turn, path=path):
    """Frame k of a land of 60 count, its cloud and its dark spots; a target of 120 count hides what is behind it."""
    y, x = (axis + by * k for axis, by in zip(np.ogrid[: SIZE[0], : SIZE[1]], turn[::-1], strict=True))
    behind = 60.0 + 5.0 * (np.sin(x / 6.0) * np.cos(y / 5.0) + 0.8 * np.sin(0.31 * x + 0.23 * y))
    behind = behind + 4.0 * np.sin(x / 16.3 - y / 23.0)  # so that no row of the land repeats another
    behind = behind + (cloud - 60.0) / (1.0 + np.exp(-(x - 95.0) / 5.0))
    behind = behind - 50.0 * np.sum([gaussian(x, y, at, (4.0, 2.5)) for at in dark], axis=0)
    at = path(k)
    hides = shown * np.minimum(1.5 * gaussian(x, y, at, (4.0, 2.5)), 1.0)
    return behind + hides * (120.0 - behind) + np.random.default_rng([9, k]).normal(0.0, 1.0, SIZE)


def followed(cloud, dark=(), shown=lambda k: 1.0, turn=(0.0, 0.0), path=path):
    """Existence (FRAMES,) of the example's track, and by how many px it is off in the last frame."""
    frames = [drawn(k, cloud, dark, shown(k), turn, path) for k in range(FRAMES)]
    existence, place = infrared.followed(frames, [*path(0), 14.0, 9.0])
    return existence, float(np.hypot(*(place[-1] - path(FRAMES - 1) + np.array(turn) * (FRAMES - 1))))


TURNS = pytest.mark.parametrize("turn", [(0.0, 0.0), (0.6, 0.1)], ids=["stands", "turns"])


@TURNS
@pytest.mark.parametrize("cloud", [170.0, 190.0, 230.0])
def test_a_target_before_a_brighter_cloud_is_held(monkeypatch, turn, cloud):
    """Where the cloud is as bright as the target it is not seen."""
    existence, off = followed(cloud, turn=turn)
    assert np.mean(existence < 0.5) < 0.1
    assert off < 1.5
    monkeypatch.setattr(template, "likelier_of", lambda plain, negative, before: plain)
    existence, off = followed(cloud, turn=turn)
    assert np.mean(existence < 0.5) > 0.1
    assert off > 10.0


@TURNS
@pytest.mark.parametrize("beside", [6.0, 9.0, 12.0])
def test_a_dark_spot_is_not_taken_for_a_target_that_vanishes(turn, beside):
    """It was there before. Only one that the target hid as it vanished cannot be told from it."""
    dark = [path(k) + [0.0, beside] for k in (38, 65)]
    existence, _ = followed(60.0, dark, lambda k: float(np.interp(k, [34, 42], [1.0, 0.0])), turn)
    assert existence[:30].min() > 0.9
    assert existence[55:].max() < 0.5


@TURNS
@pytest.mark.parametrize("gap", [(0.0, -4.0), (3.0, 2.0)])
def test_the_gap_that_a_bird_leaves_is_not_the_bird(monkeypatch, turn, gap):
    """It sat before a gap between branches from the first frame on: what was behind it was never seen, and it never went."""
    given = 60.0, [perched(0) + gap], lambda k: float(k < 30), turn, perched
    existence, _ = followed(*given)
    assert existence[:30].min() > 0.9
    assert existence[45:].max() < 0.5
    monkeypatch.setattr(judged, "goes", lambda appearance: True)
    assert followed(*given)[0][45:].max() > 0.5
