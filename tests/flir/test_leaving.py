"""What comes out of a box that showed nothing but scenery is the target."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.spots import gaussian
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators import template
from vedette_flir.estimators.leaving import Thing, _new_things

SHAPE, EDGE, BOX = (120, 160), 70.0, 14.0
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)


def wood(k):
    """Frame k of a wood as bright as a target, below a plain sky, in noise."""
    rng = np.random.default_rng(3)
    crown = EDGE + 3.0 * np.sin(X / 6.0) + 2.0 * np.sin(X / 2.7)
    trees = 150.0 + 12.0 * np.repeat(np.repeat(rng.normal(size=(40, 54)), 3, axis=0), 3, axis=1)[: SHAPE[0], : SHAPE[1]]
    return np.where(crown < Y, trees, 60.0) + np.random.default_rng([7, k]).normal(0.0, 1.5, SHAPE)


def seen(k, at):
    """Frame k with a target that hides what is behind it."""
    spot = gaussian(X, Y, at, (2.5, 2.0))
    return wood(k) * (1.0 - spot) + 160.0 * spot


def rises(k, start=20, speed=0.9):
    return np.array([80.0, EDGE + 4.0 - speed * max(k - start, 0)])


def followed(frames, at, size=BOX):
    """Existence and place of the example's track in each frame, from a box around a place."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = Gaussian(np.array([[*at, 0.0, 0.0, size, size]]), np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None])
    state, rows = tracker.start(prior, 0.0), []
    for k, pixels in enumerate(frames):
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        rows.append((state.existence[0], *tracker.estimate(state).mean[0, :2]))
    return np.array(rows)


def nothing(appearance, *given):
    return appearance, None


@pytest.mark.costly
@pytest.mark.parametrize("turn", [0, 1])
def test_what_rises_out_of_a_wood_is_the_target(turn, monkeypatch):
    """Also before a camera that turns by half a px a frame."""
    at = np.array([rises(k) + [turn * (k // 2), 0.0] for k in range(80)])
    frames = [np.roll(seen(k, rises(k)), turn * (k // 2), axis=1) for k in range(80)]
    found = followed(frames, rises(0))
    error = np.hypot(*(found[:, 1:] - at).T)
    assert np.all(error[60:] < 4.0)
    assert np.all(found[60:, 0] > 0.5)
    monkeypatch.setattr(template, "leaving", nothing)
    alone = followed(frames, rises(0))
    assert np.hypot(*(alone[-1, 1:] - at[-1])) > 20.0


@pytest.mark.costly
@pytest.mark.parametrize("way", [(1.5, 0.0), (0.0, 1.2)])
def test_what_crosses_the_box_is_not(way, monkeypatch):
    """It was outside of the box first."""
    frames = [seen(k, np.array([80.0, EDGE + 4.0]) + np.array(way) * (k - 45)) for k in range(80)]
    found = followed(frames, (80.0, EDGE + 4.0))
    monkeypatch.setattr(template, "leaving", nothing)
    assert np.array_equal(found, followed(frames, (80.0, EDGE + 4.0)))


@pytest.mark.costly
def test_of_a_box_that_shows_its_target_nothing_leaves():
    """A target stands clear above the wood, and another comes out of its box."""
    at = np.array([80.0, 50.0])
    frames = [
        seen(k, at + [0.9 * max(k - 20, 0), 0.0]) * (1.0 - (spot := gaussian(X, Y, at, (2.5, 2.0)))) + 200.0 * spot
        for k in range(80)
    ]
    found = followed(frames, at)
    assert np.all(np.abs(found[:, 1:] - at) < 4.0)
    assert np.all(found[10:, 0] > 0.5)


@pytest.mark.parametrize(
    ("first", "last", "age", "missed", "since", "came"),
    [
        ((2.0, -5.0), (2.0, -20.0), 10.0, 0.0, 15.0, True),
        ((2.0, -5.0), (2.0, -20.0), 10.0, 1.0, 15.0, False),  # not seen now
        ((20.0, -5.0), (20.0, -25.0), 10.0, 0.0, 15.0, False),  # past the box
        ((0.0, -40.0), (0.0, -20.0), 10.0, 0.0, 15.0, False),  # towards it
        ((0.0, -30.0), (0.0, -40.0), 10.0, 0.0, 15.0, False),  # it left before the box was drawn
        ((0.0, -30.0), (0.0, -40.0), 10.0, 0.0, 60.0, True),
        ((0.0, -5.0), (0.0, -20.0), 200.0, 0.0, 205.0, False),  # slower than leaves that grow
        ((0.0, -5.0), (0.0, -9.0), 10.0, 0.0, 15.0, False),  # hardly gone
    ],
)
def test_a_line_comes_out_of_the_box(first, last, age, missed, since, came):
    thing = Thing(np.array(first), np.array(last), age, missed, 8.0)
    assert thing.came_out(np.array([BOX, BOX]), since) is came


def test_what_an_error_of_a_place_makes_of_an_edge_is_not_new():
    rows, columns = np.mgrid[:48, :48].astype(float)
    slopes, noise = np.zeros((3, 48, 48)), np.random.default_rng(1).normal(0.0, 0.5, (48, 48))
    slopes[0, :, 20:23] = 60.0
    box = np.array([BOX, BOX])
    assert len(_new_things(noise + 0.2 * slopes[0], slopes, box)) == 0
    spot = 40.0 * gaussian(columns, rows, (35.0, 12.0), (2.0, 2.0))
    ((x, y),) = _new_things(noise + 0.2 * slopes[0] + spot, slopes, box)
    step = (6.0 * BOX + 12.0) / 48.0
    assert abs(x - 11.5 * step) < step
    assert abs(y + 11.5 * step) < step
