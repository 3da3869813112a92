"""What stood elsewhere in the scene while a target was held is not taken for it once it is lost."""

import numpy as np
import pytest
from attrs import evolve

from support.infrared import BOX, BY, FILTER, PEAK, SIZE, SPREAD, followed, land, steps
from support.spots import gaussian
from vedette_flir.estimators import whole_frame
from vedette_flir.estimators.earlier import AGE, CELLS, Elsewhere, kept_frame

STANDS = np.array([190.0, 85.0])


def seen(k, spots, turn=(0.0, 0.0), scale=1.0):
    """Frame k of a land, brighter below, that a camera passes by `turn` px a frame; spots in it: place and peak of each."""
    return land(k, [(at, peak, SPREAD) for at, peak in spots], turn, SIZE, 37, below=0.6, scale=scale)


def path(k):
    return np.array([60.0 + 0.8 * k, 40.0])


TURNS = pytest.mark.parametrize("turn", [(0.0, 0.0), (0.5, 0.2)], ids=["stands", "turns"])


@TURNS
@pytest.mark.parametrize("scale", [1.0, 2.0], ids=["small", "large"])
@pytest.mark.by_turns
def test_a_lost_target_is_not_taken_for_what_stood_elsewhere(monkeypatch, turn, scale):
    """The target vanishes; a spot like it stands 130 px away, and did before."""
    frames = [seen(k, [(STANDS, PEAK), (path(k), PEAK * (k < 35))], turn, scale) for k in range(60)]
    box = [*scale * path(0), 10.0 * scale, 10.0 * scale]
    existence, place = followed(frames, box)
    assert existence[:35].min() > 0.9
    assert existence[45:].max() < 0.5
    monkeypatch.setattr(Elsewhere, "new", lambda *_: (np.nan, np.inf))
    existence, place = followed(frames, box)
    there = scale * (STANDS - np.outer(np.arange(60), turn))
    assert existence[-1] > 0.5
    assert np.abs(place[-1] - there[-1]).max() < 3.0 * scale


@TURNS
@pytest.mark.costly
def test_a_target_that_comes_back_elsewhere_is_found(turn):
    """It comes back 60 px on, where nothing was before; a spot like it stands in the scene."""
    frames = [
        seen(k, [(STANDS, PEAK), (path(k) + [0.0, 45.0 * (k > 40)], PEAK * (k < 35 or k > 45))], turn) for k in range(70)
    ]
    existence, place = followed(frames, [*path(0), 10.0, 10.0])
    assert existence[43:46].max() < 0.5
    assert existence[60:].min() > 0.5
    true = [path(k) + [0.0, 45.0] - k * np.array(turn) for k in range(60, 70)]
    assert np.abs(place[60:] - true).max() < 3.0


@TURNS
@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.costly
def test_a_target_that_is_dim_beside_a_brighter_spot_of_the_scene_is_held(monkeypatch, turn, asked):
    """It fades to a third while it passes the spot 11 px below, which is more like it then than it is itself."""
    if not asked:
        monkeypatch.setattr(Elsewhere, "new", lambda *_: (np.nan, np.inf))
    spot = path(45) + [0.0, 11.0]
    bright = [PEAK * float(np.interp(k, [25, 35, 60, 70], [1.0, 0.3, 0.3, 1.0])) for k in range(80)]
    frames = [seen(k, [(spot, PEAK), (path(k), bright[k])], turn) for k in range(80)]
    existence, place = followed(frames, [*path(0), 10.0, 10.0])
    off = np.hypot(*(place - [path(k) - k * np.array(turn) for k in range(80)]).T)
    held = existence[-20:].min() > 0.9 and off[-20:].max() < 2.0 and np.mean(off > 4.0) < 0.1
    assert held == asked


@pytest.mark.costly
@pytest.mark.parametrize("nearby", [whole_frame.NEARBY, np.inf], ids=["nearby", "anywhere"])
def test_of_several_that_hide_among_their_like_each_finds_itself(monkeypatch, nearby):
    """They hide for ten frames, at uneven times, in a large frame with standing spots; other targets are new there, too."""
    monkeypatch.setattr(whole_frame, "NEARBY", nearby)
    rng = np.random.default_rng(5)
    starts, speeds = np.array([[60.0 + 70.0 * i, 60.0 + 48.0 * i] for i in range(8)]), rng.uniform(-1.5, 1.5, (8, 2))
    standing = rng.uniform(50.0, [590.0, 462.0], (30, 2))
    frames = []
    for k in range(45):
        seen_now = [(at, SPREAD) for i, at in enumerate(starts + speeds * k) if not (i < 5 and 20 <= k < 30)]
        y, x = np.ogrid[:512, :640]
        spots = sum(gaussian(x, y, at, spread) for at, spread in [*seen_now, *((at, SPREAD) for at in standing)])
        plain = 60.0 + 10.0 * np.sin(x / 40.0) + 8.0 * np.cos(y / 31.0)
        frames.append(plain + 50.0 * spots + np.random.default_rng([41, k]).normal(0.0, 1.0, (512, 640)))
    times = np.cumsum([0.0, *rng.uniform(0.01, 0.06, 44)])
    *_, (_, estimate) = steps(frames, [[*at, *BOX] for at in starts], times=list(times))
    off = np.hypot(*(estimate.mean[:, :2] - starts - 44 * speeds).T)
    assert (off.max() < 1.0) == np.isfinite(nearby)


@pytest.mark.parametrize("at", [(2.0, 30.0), (57.0, 2.0), (30.0, 57.5)])
def test_only_places_of_the_frame_are_looked_at(at):
    """A bar that ends at the frame's edge would be repeated beyond it, and like any target there."""
    y, x = np.ogrid[:60, :60]
    spot = 60.0 + PEAK * gaussian(x, y, (30.0, 30.0), SPREAD)
    known = FILTER.first(spot, np.array([30.0, 30.0]), BOX).appearance
    bars = 60.0 + PEAK * np.maximum(gaussian(x, y, at, (2.0, 40.0)), gaussian(x, y, at, (40.0, 2.0)))
    look = BY.look(bars, np.array(at), 15, known)
    assert np.all((look.place > -1.0) & (look.place < 60.0))


@pytest.mark.parametrize("shape", [(256, 320), (100, 60), (161, 90), (1080, 1920), (12, 9)])
def test_a_frame_is_kept_in_few_cells_whatever_its_size(shape):
    rng = np.random.default_rng(37)
    pixels = rng.normal(60.0, 1.0, shape)
    middle = np.array(shape[::-1]) / 2.0
    appearance = evolve(FILTER.unseen(()), size=BOX)
    for k in range(100):
        appearance = kept_frame(pixels + k, appearance, middle, held=k != 50)
        ages = appearance.earlier_at[:, 2]
        assert appearance.earlier.shape == (2, CELLS, CELLS)
        assert ages[0] < AGE + 2
        assert k < AGE / 2 or ages[0] >= AGE / 2
    look = BY.look(pixels, middle, 3, FILTER.first(pixels, middle, BOX).appearance)
    assert np.isnan(Elsewhere(appearance, pixels, middle).new(BY, look)[0])  # its own place
    kept = appearance.earlier[0]
    assert np.abs(kept[kept > 0].mean() - (60.0 + 99 - ages[0])) < 0.5
