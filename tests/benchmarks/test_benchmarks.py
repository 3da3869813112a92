"""What the benchmarks compare solves the same problem: else their ratios would mean nothing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from benchmarks import problems, race, users
from benchmarks.contenders import textbook
from benchmarks.contenders.vedette import ENTRIES
from benchmarks.limit import build

SMALL = {
    "kf": {"steps": 20},
    "ekf": {"steps": 20},
    "foreign": {"steps": 20},
    "ukf": {"steps": 20},
    "imm": {"modes": 3, "steps": 20},
    "pda": {"returns": 8, "steps": 20},
    "imm_pdaf": {"modes": 3, "returns": 8, "steps": 20},
    "gnn": {"tracks": 12, "returns": 22, "steps": 1},
}
BATCHES = ("kf", "ekf", "imm", "imm_pdaf")


def off(found: Any, right: Any) -> float:
    """How far means and covariances differ, relative to their largest entry."""
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(b))) for a, b in zip(found, right, strict=True))


def solved(contender: str, family: str, level: str, sizes: dict[str, int]) -> float:
    """How far a contender is off textbook numpy."""
    problem = problems.make(family, **sizes)
    job = import_module(f"benchmarks.contenders.{contender}").ENTRIES[family][level](problem)
    return off(job.answer(job.repeat(2)), textbook.solve(problem))


@pytest.mark.parametrize("family", SMALL)
def test_vedette_solves_what_is_timed(family: str) -> None:
    for level in ENTRIES[family]:
        assert solved("vedette", family, level, SMALL[family]) < 1e-9, level


@pytest.mark.parametrize("family", BATCHES)
@pytest.mark.by_turns
def test_batches_solve_what_is_timed(family: str) -> None:
    for level in ENTRIES[family]:
        if level == "step" or level.startswith(("kernels", "fused")):
            assert solved("vedette", family, level, SMALL[family] | {"tracks": 2019, "steps": 10}) < 1e-9, level


@pytest.mark.parametrize(
    ("family", "tracks"),
    [(family, tracks) for family in BATCHES for tracks in (None, 19) if (family, tracks) != ("ekf", None)],
)
@pytest.mark.by_turns
def test_the_limit_solves_what_is_timed(family: str, tracks: int | None) -> None:
    try:
        build.library()
    except OSError as error:
        pytest.skip(f"the limit cannot be built: {error}")
    assert solved("limit", family, "", SMALL[family] | {"tracks": tracks, "steps": 10}) < 1e-9


def test_a_contender_that_solves_another_problem_is_left_out() -> None:
    problem = problems.make("kf", steps=5)
    mean, cov = textbook.solve(problem)
    contender = race.Contender("textbook", "textbook")
    try:
        answer = {"mean": mean.tolist(), "cov": (cov * (1 + 1e-6)).tolist()}
        with pytest.raises(race.Refused, match="its cov is off by"):
            race._agree(contender, answer, (mean, cov), race.AGREE)
    finally:
        contender.close()


def test_an_absent_peer_is_told_in_a_line() -> None:
    contender = race.Contender("nobody", "nobody")
    contender.close()
    assert contender.absent.startswith("ModuleNotFoundError")
    assert "\n" not in contender.absent


def test_a_clock_that_skips_makes_nothing_faster(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 4.0, 4.0, 4.5, 4.5, 9.5])  # three rounds: 4 s, a skip of 3.5 s, 5 s
    monkeypatch.setattr(users, "spent", lambda: next(clock))
    job = users.Job("a sum", "a sum", 1, {"vedette": lambda: lambda: 1.0}, {})
    assert users.measure(job, 3).seconds == {"vedette": 4.0}
