"""Trajectory GOSPA against the linear program of its definition, with dummies and all, and against all assignments."""

from itertools import permutations

import numpy as np
import pytest

from support.many import Problem, as_published, problem
from vedette.metrics import gospa
from vedette_standard.whole_tracks import trajectory_gospa


def over_assignments(given: Problem, cutoff: float, switch: float, order: float) -> float:
    """The least over all sequences of assignments, by dynamic programming over all of them."""
    scans, rows, columns = len(given.truth), given.truth.shape[1], given.tracks.shape[1]
    every = {
        tuple(j if j < columns else -1 for j in picked)
        for picked in permutations(range(columns + rows), rows)
        if list(filter(lambda j: j >= columns, picked)) == sorted(j for j in picked if j >= columns)
    }
    choices = sorted(every)

    def cost(k, choice):
        total = 0.0
        for i, j in enumerate(choice):
            far = None if j < 0 else given.distance(k, i, j)
            if far is not None:
                total += min(far, cutoff) ** order
            else:
                there = int(given.alive[k, i]) + (j >= 0 and not np.isnan(given.tracks[k, j, 0]))
                total += there * cutoff**order / 2
        left = [j for j in range(columns) if j not in choice and not np.isnan(given.tracks[k, j, 0])]
        return total + len(left) * cutoff**order / 2

    def between(one, other):
        return switch**order / 2 * sum((a >= 0) + (b >= 0) for a, b in zip(one, other, strict=True) if a != b)

    best = {choice: cost(0, choice) for choice in choices}
    for k in range(1, scans):
        best = {new: cost(k, new) + min(best[old] + between(old, new) for old in choices) for new in choices}
    return min(best.values()) ** (1 / order)


def of(given: Problem, *numbers: float):
    return trajectory_gospa(given.apart, given.present, given.alive, *numbers)


@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("numbers", [(3.0, 2.0, 2.0), (8.0, 1.0, 1.0), (5.0, 8.0, 2.0)])
def test_it_is_the_linear_program_of_its_definition(seed, numbers):
    given = problem(seed)
    found = of(given, *numbers)
    assert found.value == pytest.approx(as_published(given, *numbers), abs=1e-7)
    parts = found.localisation + found.missed + found.false + found.switches
    assert parts == pytest.approx(found.value ** numbers[2], rel=1e-9)
    assert min(found.localisation, found.missed, found.false, found.switches) >= -1e-9


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("shape", [(5, 1, 4), (5, 3, 1), (4, 2, 3)])
def test_it_is_the_least_over_assignments_for_one_object_or_track_and_never_more(seed, shape):
    given = problem(seed, *shape)
    least, found = over_assignments(given, 5.0, 3.0, 2.0), of(given, 5.0, 3.0, 2.0).value
    assert found <= least + 1e-9
    if 1 in shape[1:]:
        assert found == pytest.approx(least)


@pytest.mark.parametrize("seed", range(5))
def test_one_scan_is_gospa_and_free_switches_are_gospa_scan_by_scan(seed):
    given = problem(seed, scans=1)
    each = [gospa(apart[alive], 5.0, 2.0) for apart, alive in zip(given.apart, given.alive, strict=True)]
    assert of(given, 5.0, 3.0, 2.0).value == pytest.approx(each[0].value)
    given = problem(seed)
    each = [gospa(apart[alive], 5.0, 2.0).value ** 2 for apart, alive in zip(given.apart, given.alive, strict=True)]
    assert of(given, 5.0, 0.0, 2.0).value == pytest.approx(np.sqrt(sum(each)))


def lines(*rows: list[float]) -> np.ndarray:
    return np.stack([np.array(rows, dtype=float).T, np.zeros((len(rows[0]), len(rows)))], axis=-1)


def test_two_tracks_that_change_places_cost_two_switches_and_a_broken_track_half_of_one_at_each_end():
    nan = np.nan
    swapped = Problem(lines([0] * 4, [100] * 4), lines([1, 1, 101, 101], [101, 101, 1, 1]))
    found = of(swapped, 10.0, 4.0, 2.0)
    assert (found.localisation, found.missed, found.false) == (pytest.approx(8.0), 0.0, 0.0)
    assert found.switches == pytest.approx(2 * 16.0)
    broken = Problem(lines([0] * 4), lines([1, 1, nan, nan], [nan, nan, 1, 1]))
    assert of(broken, 10.0, 4.0, 2.0).value == pytest.approx(np.sqrt(4 + 16.0))
    gap = Problem(lines([0] * 5), lines([1, 1, nan, 1, 1]))
    assert of(gap, 10.0, 4.0, 2.0).value == pytest.approx(np.sqrt(4 + 50.0))
    empty = Problem(lines([nan] * 3), lines([0, 0, nan]))
    assert of(empty, 10.0, 4.0, 2.0).value == pytest.approx(np.sqrt(2 * 50.0))
    assert of(Problem(lines([0, 0]), np.zeros((2, 0, 2))), 10.0, 4.0, 2.0).missed == 100.0


def test_it_is_a_metric():
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x, y, z = (np.where(rng.random((4, 2, 1)) < 0.2, np.nan, 3 * rng.standard_normal((4, 2, 2))) for _ in range(3))
        xy, yx, yz, xz = (of(Problem(a, b), 4.0, 2.0, 2.0).value for a, b in ((x, y), (y, x), (y, z), (x, z)))
        assert xy == pytest.approx(yx)
        assert xz <= xy + yz + 1e-9
        assert of(Problem(x, x), 4.0, 2.0, 2.0).value == pytest.approx(0.0, abs=1e-6)


def test_a_program_beyond_the_limit_is_left_out_but_not_parts_of_one_object():
    given = problem(0)
    assert of(given, 8.0, 1.0, 2.0, 10) is None
    alone = problem(0, truths=1)
    assert of(alone, 8.0, 1.0, 2.0, 0).value == pytest.approx(as_published(alone, 8.0, 1.0, 2.0))


def test_wrong_numbers_are_told():
    with pytest.raises(ValueError, match=r"cutoff: must be > 0 m, switch >= 0, order >= 1.*got 0, 1 and 2"):
        of(problem(0), 0.0, 1.0)
