"""Targets near each other: pixels are claimed once, ids kept where motion or likeness tells, and doubt told where not."""

import csv
from itertools import permutations

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Gaussian, Scan
from vedette.cli import main
from vedette_flir.estimators import sharing
from vedette_flir.estimators.matches import Appearance, Match
from vedette_flir.estimators.sharing import Expected, Sharing
from vedette_flir.evidence import UNLIKE

SKY = (80, 120)
KNOWN = Appearance(np.ones(()))


def spot(at, peak=60.0, spread=2.0):
    y, x = np.mgrid[: SKY[0], : SKY[1]]
    return peak * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2.0 * spread**2))


def crossing(run, apart, frames, peaks=(60.0, 60.0)):
    """Frames of two spots that meet after some 25 frames, their speeds differing by `apart` px a frame; their places."""
    rng = np.random.default_rng(run)
    step = np.array([[0.5 * apart, 0.0], [-0.5 * apart, 0.0]])
    at = np.array([[60.0, 40.0], [60.0, 40.0 + rng.uniform(-2.0, 2.0)]]) - (25.0 + rng.uniform(-0.5, 0.5)) * step
    places = at + np.arange(frames)[:, None, None] * step
    clean = (sum(map(spot, both, peaks)) for both in places)
    return [60.0 + rng.normal(0.0, 1.5, SKY) + one for one in clean], places


def followed(frames, starts):
    """Places (s, t, 2), links (s, t) and existence (s, t) of the example's tracks, from boxes of 10 px."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = np.array([[*at, 0.0, 0.0, 10.0, 10.0] for at in starts])
    cov = np.repeat(np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None], len(starts), 0)
    state, rows = tracker.start(Gaussian(prior, cov), 0.0), []
    for k, pixels in enumerate(frames):
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        rows.append((tracker.estimate(state).mean[:, :2].copy(), state.links.copy(), state.existence.copy()))
    return tuple(np.array(part) for part in zip(*rows, strict=True))


def kept(place, true):
    return bool(np.abs(place[-1] - true[-1]).max() < 4.0)


@pytest.mark.costly
def test_targets_that_cross_keep_their_ids_where_their_speeds_differ():
    """With the example's motion, which allows for sharp turns. 100 of 100 runs do: python -m benchmarks.flir_crossing."""
    for run in range(3):
        frames, true = crossing(run, 2.0, 42)
        place, _, existence = followed(frames, true[0])
        assert kept(place, true)
        assert existence.min() > 0.5


@pytest.mark.costly
def test_four_that_meet_at_once_keep_their_ids():
    """They coast together until each is found in its own place; judged in pairs some are exchanged."""
    turns = np.array([[1.4, 0.0], [-1.4, 0.0], [0.0, 1.4], [0.0, -1.4]])
    for run in range(2):
        rng = np.random.default_rng(run)
        at = np.array([60.0, 40.0]) + rng.uniform(-2.0, 2.0, (4, 2)) - 17.0 * turns
        true = at + np.arange(32)[:, None, None] * turns
        frames = [60.0 + rng.normal(0.0, 1.5, SKY) + sum(map(spot, places)) for places in true]
        place, links, existence = followed(frames, true[0])
        assert kept(place, true)
        assert np.isnan(links[17]).all()
        assert existence.min() > 0.5


@pytest.mark.costly
def test_ids_that_nothing_tells_apart_are_told_as_possibly_exchanged():
    for run in range(2):
        frames, true = crossing(run, 0.8, 50)
        _, links, _ = followed(frames, true[0])
        doubted = np.flatnonzero((links < 0.95).all(axis=1))
        assert len(doubted)
        assert doubted[0] < 45
        assert abs(np.diff(true[doubted[0], :, 0])) < 3 * 2.0  # farther off than three spreads each is told apart
        assert np.all(np.nan_to_num(links[:15], nan=1.0) > 0.95)


@pytest.mark.costly
def test_likeness_tells_apart_what_motion_does_not():
    """The scene that changes while both coast in one place is no new one; it was taken for one in 11 of 20 such runs."""
    for run in range(3):
        frames, true = crossing(run, 1.0, 60, peaks=(60.0, 30.0))
        place, _, existence = followed(frames, true[0])
        assert kept(place, true)
        assert existence.min() > 0.5


@pytest.mark.costly
def test_each_on_its_own_takes_the_others_target(monkeypatch):
    """The mutant: without sharing, both tracks end on one of two targets, or exchange them untold."""
    frames, true = crossing(0, 0.8, 50)
    monkeypatch.setattr(sharing.Sharing, "_claimed", lambda *_: {})
    _, links, _ = followed(frames, true[0])
    assert not np.any(links < 0.95)


@pytest.mark.costly
def test_a_lost_target_is_not_found_in_the_place_of_one_that_is_held():
    """One vanishes beside the other, its like: it is told as lost, and does not take the other's pixels."""
    rng = np.random.default_rng(5)
    at = np.array([[40.0, 40.0], [75.0, 40.0]])
    frames = [60.0 + rng.normal(0.0, 1.5, SKY) + spot(at[0]) + spot(at[1]) * (k < 15) for k in range(50)]
    place, _, existence = followed(frames, at)
    assert np.abs(place[:, 0] - at[0]).max() < 1.0
    assert existence[:, 0].min() > 0.5
    assert existence[30:, 1].max() < 0.5


class World:
    """Targets that are found where they are said to be, each with a likeness at each place."""

    def __init__(self, expected, found, likeness, variance=1.0, box=10.0):
        self.found = np.array(found, dtype=float)
        self.likeness = likeness
        self.expected = [
            Expected(np.array(at, dtype=float), np.full(2, box), variance * np.eye(2), True, KNOWN) for at in expected
        ]

    def find(self, i, image, at):
        """The own place if asked around the expected one, and else that nearest to where it is asked for."""
        own = bool(np.allclose(at, self.expected[i].where))
        place = i if own else int(np.argmin(np.linalg.norm(self.found - at, axis=1)))
        return Match(self.found[place] - at, 20.0, KNOWN, 1.0, False, 1.0, self.likeness[i][place])

    def shared(self):
        who = Sharing(np.zeros(SKY), self.expected, self.find, lambda image, at, appearance: image)
        matches, link = who.found()
        return np.array([self.expected[i].where + match.residual for i, match in enumerate(matches)]), link


@pytest.mark.parametrize("likeness", [((0.9, 0.9), (0.9, 0.9)), ((0.95, 0.9), (0.9, 0.93)), ((0.8, 0.9), (0.9, 0.8))])
def test_links_are_those_of_the_likelier_way(likeness):
    """The log-odds are 2 (a - b)' C^-1 (p - q) + (s - s') / u, as Bayes's rule over both ways gives."""
    expected, found, variance = np.array([[40.0, 40.0], [41.0, 40.0]]), np.array([[38.0, 40.0], [44.0, 40.0]]), 4.0
    logs = []
    for way in ((0, 1), (1, 0)):
        squares = sum(np.sum((found[way[i]] - expected[i]) ** 2) for i in (0, 1)) / variance
        cross = (found[way[0]] - found[way[1]] - expected[0] + expected[1]) ** 2 / (2.0 * variance)
        mean = np.sum((found.sum(0) - expected.sum(0)) ** 2) / (2.0 * variance)
        assert squares == pytest.approx(np.sum(cross) + mean)  # only the difference of the two tells the ways apart
        logs.append(-0.5 * squares - sum(1.0 - likeness[i][way[i]] for i in (0, 1)) / UNLIKE)
    best = int(np.argmax(logs))
    place, link = World(expected, found, likeness, variance).shared()
    np.testing.assert_allclose(place, found if best == 0 else found[::-1])
    assert link == pytest.approx(np.full(2, np.exp(logs[best]) / np.sum(np.exp(logs))))


@pytest.mark.parametrize("seed", range(8))
def test_places_of_a_group_are_shared_out_at_least_cost(seed):
    """Of all permutations of three; a link is 1 over 1 plus the odds of each exchange."""
    rng = np.random.default_rng(seed)
    expected = np.array([[40.0, 40.0], [44.0, 40.0], [42.0, 44.0]])
    found, variance = rng.permutation(expected) + rng.normal(0.0, 0.4, (3, 2)), 8.0
    likeness = rng.uniform(0.7, 1.0, (3, 3))
    cost = np.sum((expected[:, None] - found) ** 2, axis=-1) / (2.0 * variance) + (1.0 - likeness) / UNLIKE
    ways = [list(way) for way in permutations(range(3))]
    best = min(ways, key=lambda way: cost[range(3), way].sum())
    own = cost[:, best]
    odds = own + own.T - np.diag(own) - np.diag(own)[:, None]
    place, link = World(expected, found, likeness, variance, box=4.0).shared()
    np.testing.assert_allclose(place, found[best])
    np.testing.assert_allclose(link, 1.0 / np.exp(-np.maximum(odds, 0.0)).sum(axis=1))


def test_those_expected_in_one_place_coast_together_until_each_has_its_own():
    """Three in two places: all wait. As soon as there are three places, each goes on."""
    expected, places = [[40.0, 40.0], [43.0, 40.0], [46.0, 40.0]], [[38.0, 40.0], [43.5, 40.0], [43.5, 40.0]]
    _, link = World(expected, places, np.full((3, 3), 0.9), 4.0).shared()
    assert np.isnan(link).all()
    place, link = World(expected, [*places[:2], [49.0, 40.0]], np.full((3, 3), 0.9), 4.0).shared()
    np.testing.assert_allclose(place[:, 0], [38.0, 43.5, 49.0])
    assert np.all(link > 0.5)


def test_one_place_for_two_is_nobodys_where_both_were_expected_there_and_the_nearers_else():
    one = [[40.0, 40.0]]
    place, link = World([[39.0, 40.0], [42.0, 40.0]], one * 2, ((0.9, 0.9), (0.9, 0.9))).shared()
    assert np.isnan(link).all()
    place, link = World([[40.5, 40.0], [47.0, 40.0]], one * 2, ((0.9, 0.9), (0.9, 0.9))).shared()
    np.testing.assert_allclose(place[0], one[0])
    assert link == pytest.approx(np.ones(2), abs=1e-6)


def test_targets_far_apart_are_found_as_each_would_be_alone():
    place, link = World([[20.0, 20.0], [70.0, 60.0]], [[70.0, 60.0], [20.0, 20.0]], ((0.1, 0.9), (0.9, 0.1))).shared()
    np.testing.assert_allclose(place, [[70.0, 60.0], [20.0, 20.0]])
    assert np.all(link == 1.0)


@pytest.mark.costly
def test_a_run_tells_of_ids_that_may_have_been_exchanged(tmp_path, capsys):
    frames, true = crossing(1, 0.8, 40)
    folder, out = tmp_path / "clip", tmp_path / "out"
    folder.mkdir()
    for k, pixels in enumerate(frames):
        cv2.imwrite(str(folder / f"{k:03d}.png"), np.clip(np.rint(pixels), 0, 255).astype(np.uint8))
    boxes = [[float(x) - 4.0, float(y) - 4.0, 10.0, 10.0] for x, y in true[0]]
    code = main(
        ["run", str(EXAMPLES / "flir_clip.toml"), "--set", f"source.path={folder}", "--set", f"source.boxes={boxes}"]
        + ["--out", str(out)]
    )
    said = capsys.readouterr().out
    assert code == 0
    assert "tracks 0 and 1, with probability" in said
    events = list(csv.DictReader((out / "episodes.csv").read_text().splitlines()))
    exchanged = [row for row in events if row["event"].startswith("may have been exchanged")]
    assert {(row["track"], row["event"].rsplit(" ", 1)[1]) for row in exchanged} == {("0", "1"), ("1", "0")}
    links = [float(row["link"]) for row in csv.DictReader((out / "tracks.csv").read_text().splitlines()) if row["link"]]
    assert min(links) < 0.95
