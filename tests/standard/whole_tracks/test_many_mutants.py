"""The definitions of the metrics of whole tracks catch what could be wrong with the code: one change of it each."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from support.many import Problem, as_published, hota_by_definition, ospa2_by_definition, problem
from vedette_standard.whole_tracks import hota, ospa2, trajectory


def problems():
    """Of one to three objects, near their tracks and far; one may never be there, or one track only be."""
    for seed in (*range(12), 62):
        given = problem(seed, scans=8, truths=1 + (seed + 1) % 3, tracks=4, spread=1.0 + 2.0 * (seed % 2))
        if seed == 10:
            given.truth[:, 1], given.tracks[:, 1:] = np.nan, np.nan
        yield given


def changed(module: ModuleType | Callable[..., object], old: str, new: str) -> ModuleType:
    """Return the module anew, with one piece of its source replaced."""
    name = getattr(module, "__module__", None) or module.__name__
    path = Path(__import__(name, fromlist=["x"]).__file__ or "")
    source = path.read_text(encoding="utf-8")
    assert source.count(old) == 1, f"{old!r} is {source.count(old)} times in {path.name}"
    mutant = ModuleType("mutant")
    mutant.__dict__["__name__"] = name
    exec(compile(source.replace(old, new), str(path), "exec"), mutant.__dict__)
    return mutant


def trajectory_fits(code, given: Problem) -> bool:
    try:
        found = code.trajectory_gospa(given.apart, given.present, given.alive, 5.0, 3.0, 2.0)
    except ArithmeticError:  # its program has no end
        return False
    parts = found.localisation + found.missed + found.false + found.switches
    return bool(
        np.isclose(found.value, as_published(given, 5.0, 3.0, 2.0), atol=1e-7)
        and np.isclose(parts, found.value**2)
        and found.missed >= 0
    )


def ospa2_fits(code, given: Problem) -> bool:
    found = code.ospa2(given.apart, given.present, given.alive, given.tracks.shape[1], 4.0, 2.0)
    return bool(np.isclose(found, ospa2_by_definition(given, range(len(given.truth)), 4.0, 2.0)))


def hota_fits(code, given: Problem) -> bool:
    found = code.hota(given.apart, given.present, given.alive, given.tracks.shape[1], 5.0)
    parts = [found.value, found.detection, found.association, found.localisation]
    return bool(np.allclose(parts, hota_by_definition(given, 5.0)))


MUTANTS = [
    ("penalty = 0.5 *", "penalty = 1.0 *"),
    ("missed, false = missed - paired, false - paired", "missed, false = missed - paired, false"),
    ("stays[k] = best <= switched", "stays[k] = best <= switched - penalty"),
    ("best[from_pair[k]] + 2 * penalty", "best[from_pair[k]] + penalty"),
    ("at = at if stays[k, at] else int(from_pair[k])", "at = at"),
    ("for side in (part.truth, part.track) for number", "for side in (part.truth,) for number"),
    ("((up, after, before), (down, before, after))", "((up, after, before),)"),
    (".max() <= 1.0 for member", ".max() <= 9.0 for member"),
    ("((part.truth, part.track), (part.track, part.truth)):", "((part.truth, part.truth), (part.track, part.track)):"),
    ("near_in_scans(apart, present, cutoff)", "near_in_scans(apart, present, 0.5 * cutoff)"),
]
OF_OSPA2 = [
    ("+ there[track] - _both(truth, track, present, alive)", "+ there[track]"),
    ("(distance / cutoff) ** order", "(distance / cutoff)"),
    ("whole.among(np.any(alive, axis=0), there > 0)", "whole"),
    ("np.maximum(1.0 - excess / either, 0.0) ** (1 / order)", "(1.0 - excess / either)"),
    ("(np.diff(scan) == 1) & ", ""),
    ("before[scan[last[run]] + 1, truth[pair]]", "before[scan[last[run]], truth[pair]]"),
]
OF_HOTA = [
    ("np.arange(1, 20) / 20", "np.arange(1, 19) / 20"),
    ("track[i:k], -worth[i:k], 0.0)", "track[i:k], -like[i:k], 0.0)"),
    ("entries[pair % max(tracks, 1)] - shared", "entries[pair % max(tracks, 1)]"),
    ("sums[0] + sums[1] - like", "sums[0] + sums[1]"),
    ("np.sum(objects) + np.sum(entries)) - positives", "np.sum(objects) + np.sum(entries))"),
    ("entries[key % max(len(entries), 1)] - count", "entries[key % max(len(entries), 1)]"),
    ("np.mean((count / either)[again.reshape(-1)])", "np.mean(count / either)"),
    ("np.sqrt(detection * association)", "detection * association"),
]


@pytest.mark.parametrize(
    ("module", "fits", "old", "new"),
    [
        *((trajectory, trajectory_fits, *pair) for pair in MUTANTS),
        *((ospa2, ospa2_fits, *pair) for pair in OF_OSPA2),
        *((hota, hota_fits, *pair) for pair in OF_HOTA),
    ],
)
@pytest.mark.by_turns
def test_a_wrong_piece_is_noticed(module, fits, old, new):
    wrong, right = changed(module, old, new), changed(module, old, old)
    assert all(fits(right, given) for given in problems())
    assert not all(fits(wrong, given) for given in problems())
