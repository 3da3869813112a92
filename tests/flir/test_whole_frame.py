"""A target that was lost is sought in the whole frame: what stood there before, and what is like it, is weighed."""

import numpy as np
import pytest
from attrs import evolve

from support.infrared import BOX, BY, FILTER, PEAK, SIZE, SPREAD, land
from vedette_flir.estimators import earlier, seen_before, two_frames
from vedette_flir.estimators.earlier import YOUNG, Elsewhere, kept_frame
from vedette_flir.estimators.template_search import NEAR
from vedette_flir.estimators.whole_frame import sought
from vedette_flir.registration import applied

START = np.array([70.0, 40.0])


def drawn(k, places, turn=(0.0, 0.0)):
    """Frame k of a land that is brighter below, and spots like the target, so many times as bright if that is said."""
    spots = [(np.array(at[:2], float), PEAK * (at[2] if len(at) > 2 else 1.0), SPREAD) for at in places]
    return land(k, spots, turn, SIZE, 43, texture=3.0, below=0.6)


def found(then, now, here, expected, turn=(0.0, 0.0)):
    """Return place and log-odds of a target that was at `START` in one frame, lost for a while, and is sought in another.

    `then` and `now`: the places of spots; `here`: where it is expected now, with the log-odds `expected`.
    """
    before, after = drawn(0, [*then, START]), drawn(20, now, turn)
    known = kept_frame(before, FILTER.first(before, START, BOX).appearance, START, held=True)
    known = evolve(known, earlier_at=known.earlier_at + [0.0, 0.0, YOUNG + 12.0])
    here = np.array(here, float)
    elsewhere = Elsewhere(known, after, here)
    look = BY.look(after, here, NEAR, known)
    best, odds = sought(BY, after, known, look, expected, elsewhere, same_scene=True)
    return best.place, odds


def test_what_speaks_against_the_place_expected_speaks_against_what_is_found_there_again():
    """A track has come to stand on a spot like its target, which comes back elsewhere."""
    twin, back = (72.0, 41.0), (150.0, 60.0)
    place, odds = found([], [twin, back], twin, -10.0)
    assert np.abs(place - back).max() < 1.0
    assert odds > 1.0
    place, odds = found([], [twin], twin, -10.0)
    assert odds < 0.0


@pytest.mark.parametrize("turn", [(0.0, 0.0), (0.4, 0.2)], ids=["stands", "turns"])
def test_what_is_new_in_a_scene_is_found_among_things_as_bright(monkeypatch, turn):
    """Fourteen spots like it stand there that are brighter."""
    rng = np.random.default_rng(43)
    standing = [at for at in rng.uniform([20.0, 8.0], [225.0, 80.0], (60, 2)) if np.hypot(*(at - START)) > 25.0][:14]
    back = np.array([120.0, 104.0, 0.8])
    found_at, odds = found(standing, [*standing, back], START, -8.0, turn)
    assert np.abs(found_at - (back[:2] - 20.0 * np.array(turn))).max() < 1.5
    assert odds > 0.0
    monkeypatch.setattr(Elsewhere, "places", lambda *_: [])
    found_at, odds = found(standing, [*standing, back], START, -8.0, turn)
    assert odds < 0.0


def test_what_stood_at_the_edge_of_a_frame_is_known_there(monkeypatch):
    for edge in ((150.0, 116.0), (237.0, 60.0)):
        assert found([edge], [edge], START, -8.0)[1] < 0.0
        assert found([], [(150.0, 60.0)], START, -8.0)[1] > 0.0
    monkeypatch.setattr(seen_before, "SEEN", 1.1)
    assert found([(150.0, 116.0)], [(150.0, 116.0)], START, -8.0)[1] > 0.0


def test_what_comes_into_view_is_taken_for_one_of_the_things_like_it():
    """The camera turns; at its edge comes a spot that was not in view. If others stand in the scene, it is one of those."""
    turn, new = (1.5, 0.0), (255.0, 60.0)
    standing = [(110.0, 75.0), (160.0, 90.0), (180.0, 30.0)]
    assert found([], [new], (60.0, 40.0), -8.0, turn)[1] > 0.0
    assert found(standing, [*standing, new], (60.0, 40.0), -8.0, turn)[1] < 0.0


def moved(back, scale=1.0):
    """Return how far a place in the middle of a frame of 80 cells came (2,) in px, that a matrix (3, 3) brings back."""
    return scale * (40.0 - applied(back, np.full(2, 40.0)))


@pytest.mark.parametrize("shape", [(160, 90), (90, 160)], ids=["tall", "wide"])
@pytest.mark.parametrize("gone", [(20.0, 0.0), (0.0, 20.0), (22.0, 40.0), (24.0, 3.0), (5.0, -3.0)])
def test_how_far_a_scene_went_is_known_in_frames_of_any_shape(shape, gone):
    """Up to a quarter of each side; what went farther is taken for less, and ends no run."""
    y, x = np.ogrid[: shape[0], : shape[1]]
    waves = [(3.1, 0.21, 0.4), (0.7, 0.13, 2.0), (1.9, 0.17, 1.0), (2.4, 0.29, 5.0)]

    def scene(off):
        u, v = x - off[0], y - off[1]
        return 60.0 + 8.0 * sum(np.sin(w * (u * np.cos(a) + v * np.sin(a)) + phase) for a, w, phase in waves)

    place = np.array(shape[::-1]) / 2.0
    known = kept_frame(scene((0.0, 0.0)), FILTER.first(scene((0.0, 0.0)), place, BOX).appearance, place, held=True)
    _, (*_, (_, back)), scale = Elsewhere(known, scene(gone), place)._registered
    within = np.all(np.abs(gone) < np.array(shape[::-1]) / 4.0 - 2.0)
    assert not within or np.abs(moved(back, scale) - gone).max() < 1.0


def test_a_scene_is_found_again_by_what_stands_in_it_and_not_by_the_target(monkeypatch):
    """In a plain scene, the earlier frame fits best with the target in it laid upon a spot of this one."""
    y, x = np.ogrid[: SIZE[0], : SIZE[1]]
    wave = 60.0 + 3.0 * np.sin(x / 23.0) * np.cos(y / 17.0)
    then, now = (
        wave + 60.0 * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0) + np.random.default_rng([47, k]).normal(size=SIZE)
        for k, at in enumerate([(100.0, 55.0), (125.0, 65.0)])
    )
    place = np.array([100.0, 55.0])
    known = kept_frame(then, FILTER.first(then, place, BOX).appearance, place, held=True)
    assert np.abs(moved(Elsewhere(known, now, place)._registered[1][-1][1])).max() < 3.0
    monkeypatch.setattr(two_frames, "_without_outliers", lambda image: image)
    monkeypatch.setattr(two_frames, "_fitted", lambda then, now, turn: (turn, 0.0))  # which would mend it here
    assert np.abs(moved(Elsewhere(known, now, place)._registered[1][-1][1])).max() > 10.0


@pytest.mark.parametrize(("roll", "zoom"), [(0.15, 1.0), (-0.08, 1.1), (0.0, 0.85)])
def test_what_stood_elsewhere_is_known_as_the_camera_rolls_and_zooms(monkeypatch, roll, zoom):
    """A spot stands far from the middle; by a shift alone it would be new."""
    y, x = (each - 60.0 for each in np.ogrid[:120, :120])
    waves = [(3.1, 0.21, 0.4), (0.7, 0.13, 2.0), (1.9, 0.17, 1.0), (2.4, 0.09, 5.0)]
    c, s = np.cos(roll) / zoom, np.sin(roll) / zoom

    def scene(u, v, spots):
        seen = 60.0 + 4.0 * sum(np.sin(w * (u * np.cos(a) + v * np.sin(a)) + phase) for a, w, phase in waves)
        return seen + sum(60.0 * np.exp(-((u - at[0]) ** 2 + (v - at[1]) ** 2) / 8.0) for at in spots)

    stands, target = np.array([38.0, -30.0]), np.array([-20.0, 10.0])
    then, now = scene(x, y, [stands, target]), scene(c * x - s * y, s * x + c * y, [stands])
    known = kept_frame(then, FILTER.first(then, target + 60.0, BOX).appearance, target + 60.0, held=True)
    known = evolve(known, earlier_at=known.earlier_at + [0.0, 0.0, YOUNG])
    there = np.linalg.solve([[c, -s], [s, c]], stands) + 60.0

    def new():
        elsewhere = Elsewhere(known, now, target + 60.0)
        return elsewhere.new(BY, BY.look(now, there, NEAR, known))[0], elsewhere.places(known)

    assert new()[0] < 0.2
    assert not [place for place in new()[1] if np.hypot(*(place - there)) < 6.0]
    monkeypatch.setattr(two_frames, "_fitted", lambda then, now, turn: (turn, 0.0))
    assert not new()[0] < 0.5


def test_what_stood_on_the_sea_is_known_where_waves_hardly_tell_how_far_the_camera_turned(monkeypatch):
    """It is like the target, which has left. By the earlier frame as it was it is new."""
    y, x = np.ogrid[: SIZE[0], : SIZE[1]]
    turned, stands, target = np.array([5.0, 1.0]), np.array([150.0, 60.0]), np.array([60.0, 40.0])

    def scene(rng, off, spots):
        u, v = x + off[0], y + off[1]
        land = 8.0 * np.sin(u / 9.0) * np.cos(v / 7.0) * (v > 95.0)
        boats = sum(60.0 * np.exp(-((u - at[0]) ** 2 + (v - at[1]) ** 2) / 8.0) for at in spots)
        return 60.0 + land + boats + rng.normal(0.0, 4.0, SIZE)

    def new(seed):
        rng = np.random.default_rng(seed)
        then, now = scene(rng, np.zeros(2), [stands, target]), scene(rng, turned, [stands])
        known = kept_frame(then, FILTER.first(then, target, BOX).appearance, target, held=True)
        known = evolve(known, earlier_at=known.earlier_at + [0.0, 0.0, YOUNG])
        look = BY.look(now, stands - turned, NEAR, known)
        return Elsewhere(known, now, target - turned).new(BY, look)[0]

    assert max(map(new, range(12))) < 0.5
    monkeypatch.setattr(earlier, "AS_WELL", 1.0)
    assert max(map(new, range(12))) > 0.7
