"""A draft of targets that keep their courses: a filter must still be able to learn that one turns."""

from types import SimpleNamespace

import numpy as np
import pytest

from vedette_tools.drafting.chains import Chain, unbroken
from vedette_tools.drafting.config import draft_config
from vedette_tools.drafting.reading import _noise
from vedette_tools.drafting.seen import Seen

FLAT = SimpleNamespace(polar=False, reported=False, floors=(0.0,))


def file_of(path, turn_after, seed=3):
    """100 looks, 3 s apart, at a target that goes straight, or turns once after some looks; 11 m of noise."""
    rng = np.random.default_rng(seed)
    course = np.maximum(0, np.arange(100) - turn_after) * 0.03
    steps = 18 * np.stack([np.cos(course), np.sin(course)], axis=-1)
    places = np.cumsum(steps, axis=0) + rng.normal(0, 11, (100, 2))
    path.write_text("t,x,y\n" + "".join(f"{3 * k},{x:.2f},{y:.2f}\n" for k, (x, y) in enumerate(places)))
    return path


def sigma_accel(text):
    line = next(line for line in text.splitlines() if line.startswith("motion"))
    return float(line.split("sigma_accel = ")[1].split(" ")[0]), line


@pytest.mark.costly
def test_straight_courses_are_drafted_with_noise_that_is_felt_within_a_hundred_scans(tmp_path):
    drafts = [sigma_accel(draft_config(file_of(tmp_path / "straight.csv", 100, seed))) for seed in range(3)]
    assert min(found for found, _ in drafts) * 300**1.5 / np.sqrt(3) > 0.7 * 11
    assert any("would hardly notice a turn" in line for _, line in drafts)


@pytest.mark.costly
def test_what_turns_is_drafted_as_it_is(tmp_path):
    found, line = sigma_accel(draft_config(file_of(tmp_path / "turns.csv", 50)))
    assert found * 300**1.5 / np.sqrt(3) > 3 * 11
    assert "of greatest likelihood" in line


def test_a_chain_is_cut_where_it_goes_over_to_another_target():
    spots = np.stack([10.0 * np.arange(20), np.zeros(20)], axis=-1)
    spots[12:, 1] += 80.0
    whole = Chain(np.arange(20), np.zeros(20, dtype=int), np.arange(20.0), spots)
    assert [len(piece.times) for piece in unbroken(whole, 40.0)] == [12, 8]
    assert [len(piece.times) for piece in unbroken(whole, 90.0)] == [20]
    late = Chain(whole.scans, whole.returns, np.where(np.arange(20) < 5, whole.times, whole.times + 6), spots)
    assert [len(piece.times) for piece in unbroken(late, 40.0)] == [5, 7, 8]  # a pause of 7 s that moved it 10 m


def test_a_return_off_the_way_is_a_piece_of_its_own():
    """It began a piece, and two in 76 returns made errors of 38 m of 14. What goes on otherwise is not left out."""
    spots = np.stack([10.0 * np.arange(20), np.zeros(20)], axis=-1)
    for off in ([7], [7, 8]):
        spots[off, 1] = 500.0 * np.arange(1, 1 + len(off))
        chain = Chain(np.arange(20), np.zeros(20, dtype=int), np.arange(20.0), spots)
        assert [len(piece.times) for piece in unbroken(chain, 40.0)] == [7, 1, 12] if len(off) == 1 else [7, 13]


def test_targets_that_swap_chains_are_not_taken_for_violent_ones():
    """Two straight courses joined wrongly where one passes the other: the likeliest noise is that of the courses."""
    rng, times = np.random.default_rng(5), 3.0 * np.arange(60)
    there = np.stack([6.0 * times, 3.0 * times], axis=-1) + rng.normal(0, 12, (60, 2))
    back = np.stack([6.0 * times, 600 - 3.0 * times], axis=-1) + rng.normal(0, 12, (60, 2))
    swapped = np.where((np.arange(60) < 34)[:, None], there, back + [0.0, 200.0])
    chain = Chain(np.arange(60), np.zeros(60, dtype=int), times, swapped)
    seen = Seen(times, tuple(swapped[:, None]), np.zeros((60, 2)), (chain,))
    found = _noise(FLAT, seen)
    assert found.sensor[0] == pytest.approx(12, rel=0.25)
    assert found.accel < 0.15
