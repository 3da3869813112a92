"""A draft proves itself: a stated set of alternatives is tried on its own data, and the best is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from time import process_time

import numpy as np
from attrs import define, evolve, field, frozen

from vedette.progress import Progress, silent
from vedette_tools.drafting.design import GATE, WIDE, Design
from vedette_tools.drafting.trial import SHORT, Trial

WHOLE = 1.03
"""Of alternatives that break no more than so many times the tracks of the best, the likeliest is kept: by hand."""

LESS, LESS_IN_CLUTTER = 0.05, 0.3
"""An alternative may explain by such a part fewer returns than the one that explains most; in clutter, where these may be
false, it is then not to be clearly less likely: by hand, on drawn scenes."""

TRACK = 30.0
"""Of objects that report in turn a track more is worth it if returns are likelier by this: about what its birth costs. Few
tracks may be of several objects there, as returns of one time are not. By hand, on the ships of one recording.
"""

PIECES = 1.25
"""It is not if it follows another, as a piece of one that was cut: of as many at once there are at most so many times the
tracks. By hand, on the same ships, and on targets that stop.
"""

GAIN = 0.2
"""A first design is left for one with more whole tracks, or likelier by this for each of their returns: by hand."""

DOUBTED = 0.5
"""Errors larger than found, and what explains fewer returns in clutter, must not be less likely by more than this for each
return of tracks. By hand, on four scenes."""

MIXED = 1.25
"""Tracks that may take returns of another name break at most so many times as often, or they mix names. By hand, on parts of
one recording of aircraft and two of ships, with a twentieth of the names wrong and without: 1.1 where right, 1.9 where not.
"""

CLEAN = 0.9
"""Where steady motion explains such a part of the returns, hardly any is false."""

FITS, LONE = 0.5, 0.5
"""A draft fits if its tracks explain such a part of the returns that steady motion explains, and of all where there is
one at a time: by hand."""

BITS = 0.1
"""Short tracks that together explain no more than such a part of what all do are of false returns, however many: by hand."""

SHARPER = 30.0
"""Beyond so many times the acceleration noise that was found, starts and stops are another manoeuvre. By hand."""

BUDGET = 50.0
"""s of CPU from the beginning of a draft, after which no further alternative is tried."""


@frozen
class Proof:
    """The design that is kept, what is said of it and of those that were tried, and why it does not fit, "" if it does."""

    design: Design
    said: tuple[str, ...]
    failure: str
    trial: Trial | None = None


@define
class _Trials:
    """What the designs that were tried showed, and which could not be run."""

    run: Callable[[Design], Trial | None]
    in_turn: bool
    progress: Progress
    budget: float
    clock: Callable[[], float]
    known: dict[Design, Trial] = field(factory=dict)
    failed: set[Design] = field(factory=set)
    longest: float = 0.0
    spent: bool = False
    begun: float = field(init=False)

    def __attrs_post_init__(self) -> None:
        self.begun = self.clock()

    def run_all(self, designs: list[Design]) -> None:
        """Try those that were not tried yet, while there is time."""
        for design in self.progress(designs, "alternatives tried"):
            before = self.clock()
            self.spent = bool(self.known or self.failed) and before - self.begun + self.longest > self.budget
            if self.spent:
                break
            if design in self.known or design in self.failed:
                continue
            if (trial := self.run(design)) is None:
                self.failed.add(design)
            else:
                self.known[design] = trial
            self.longest = max(self.longest, self.clock() - before)

    def best(self, best: Design, stages: Sequence[Callable[[Design], Iterator[Design]]], clean: bool) -> Design:
        """Return the best design of all stages, whose names are as sure as those of the one they begin at."""
        for stage in stages:
            if stage is _errors and best.correlated:
                continue
            self.run_all([best, *stage(best)])
            if alike := {design: trial for design, trial in self.known.items() if design.sure == best.sure}:
                best = kept(_no_worse(alike, best, clean), best, clean=clean, in_turn=self.in_turn)
            if self.spent:
                break
        return best


def proved(
    first: Design,
    run: Callable[[Design], Trial | None],
    steady: float,
    *,
    errors: bool = True,
    in_turn: bool = False,
    lone: bool = False,
    vague: float = 0.0,
    progress: Progress = silent,
    budget: float = BUDGET,
    clock: Callable[[], float] = process_time,
) -> Proof:
    """Return the best of the alternatives to a first design; `run` tries one, `steady` is the part of returns in chains.

    errors: whether those of the sensors are doubted. in_turn: whether targets report one by one, at rates that may differ.
    lone: whether there is one return at a time. vague: the error of a position, in m, where it is absurd beside the spread
    of all. budget: what the trials may take by the `clock`, in s; the first is always tried.

    Each stage changes the best of the stage before: how often targets report, the acceleration and a mode for manoeuvres,
    then the errors, then gate and speeds. Where names are `sure` at first and turn out not to be, all is tried anew.
    """
    clean = steady >= CLEAN
    rates = (_rates,) if in_turn else ()
    widths = (*([_errors] if errors and clean else []), _widths)
    trials = _Trials(run, in_turn, progress, budget, clock)
    # what lies outside of a gate starts no second track of a sure name: there, how targets move counts first
    stages = (_motions, *rates, *widths) if first.sure else (*rates, _motions, *widths)
    best = trials.best(first, stages, clean)
    known, failed = trials.known, trials.failed
    if first.sure and _misnamed(trials, best):
        best = trials.best(evolve(first, sure=False), (*rates, _motions, *widths), clean)
    if best not in known:
        failure = "nothing fits these data: no alternative can be run on them"
        return Proof(first, (failure,), failure)
    failure = _failure(known[best], max(FITS * steady, LONE * lone), steady, vague, best.sure)
    said = [*([failure] if failure else []), f"tried on its own data: {known[best]}"]
    said += (
        [f"  of {len(known)} alternatives; the first was: {first}: {known[first]}"]
        if first in known and best != first
        else []
    )
    said += [f"  {len(failed)} alternatives could not be run on these data"] if failed else []
    said += [f"  no further alternatives were tried: a draft may take {BUDGET:g} s of CPU"] if trials.spent else []
    return Proof(best, tuple(said), failure, known[best])


def kept(known: dict[Design, Trial], before: Design, *, clean: bool, in_turn: bool = False) -> Design:
    """Return the likeliest of those whose tracks are about as whole, and explain about as much, as any.

    Where returns are `clean` of false ones every track counts, however short; where names are sure, each has one. Of objects
    that report `in_turn` a track more may be worth it. That is the design from `before` unless it is not among these, or
    another is clearly likelier.
    """
    widest = max(known.values(), key=lambda trial: trial.share)
    likely = (
        np.inf if clean else widest.loglik - DOUBTED * widest.explained
    )  # returns that are false are as likely to be none's
    able = {
        design: trial
        for design, trial in known.items()
        if trial.share >= (1 - LESS) * widest.share
        or (trial.share >= (1 - LESS_IN_CLUTTER) * widest.share and trial.loglik >= likely)
    }
    broken = {design: _broken(design, trial, clean) for design, trial in able.items()}
    fewest = min(able, key=lambda design: broken[design])

    def worth(design: Design) -> bool:
        gain = able[design].loglik - able[fewest].loglik
        is_cut = broken[design] / able[design].at_once > PIECES * broken[fewest] / able[fewest].at_once
        is_alike = in_turn and design.often == fewest.often and not is_cut
        return is_alike and gain > TRACK * (broken[design] - broken[fewest])

    whole = [design for design in able if broken[design] <= WHOLE * broken[fewest] + 0.5 or worth(design)]
    best = max(whole, key=lambda design: able[design].loglik)
    if before in whole and able[best].loglik < able[before].loglik + GAIN * able[before].explained:
        return before
    return best


def _broken(design: Design, trial: Trial, clean: bool) -> float:
    tracks = trial.named if design.sure and trial.named else trial.tracks if clean else trial.long
    return tracks + trial.misnamed


def _no_worse(known: dict[Design, Trial], before: Design, clean: bool) -> dict[Design, Trial]:
    """Return the trials without those of other errors or larger acceleration that are far less likely, for some make tracks
    whole, and objects that report in turn one; and, in clutter, of faster targets that hardly explain more returns: false
    ones lie in births that are spread so wide.
    """
    if before not in known:
        return known
    least = known[before].loglik - DOUBTED * known[before].explained
    more = 0.0 if clean else (1 + LESS) * known[before].explained
    return {
        design: trial
        for design, trial in known.items()
        if ((design.errors == before.errors and design.accel <= before.accel) or trial.loglik >= least)
        and (design.speed <= before.speed or trial.explained >= more)
    }


def _misnamed(trials: _Trials, best: Design) -> bool:
    """Return whether names are not sure: tracks that may take a return of another name make them likelier, and mix none."""
    trials.run_all([twin := evolve(best, sure=False)])
    sure, doubted = trials.known.get(best), trials.known.get(twin)
    if sure is None or doubted is None:
        return sure is None
    return sure.loglik < doubted.loglik and doubted.broken <= MIXED * sure.broken


def _rates(best: Design) -> Iterator[Design]:
    for factor in (3.0, 10.0, 20.0):
        yield evolve(best, often=factor)


def _motions(best: Design) -> Iterator[Design]:
    for accel in (best.accel / 4, best.accel):
        for agile in (4 * best.accel, 15 * best.accel, *([best.sharp] if best.sharp > SHARPER * best.accel else [])):
            for lasts in (1.0, 10.0):
                yield evolve(best, accel=accel, agile=agile, lasts=lasts)
    for factor in (2.5, 6.0, 15.0):
        yield evolve(best, accel=factor * best.accel)
    if best.correlated:
        yield evolve(best, correlated=False, accel=best.found, gate=GATE)


def _errors(best: Design) -> Iterator[Design]:
    for factor in (0.3, 3.0, 10.0):
        yield evolve(best, errors=factor)


def _widths(best: Design) -> Iterator[Design]:
    yield evolve(best, gate=WIDE)
    yield evolve(best, speed=3 * best.speed)
    yield evolve(best, speed=3 * best.speed, gate=WIDE)


def _failure(trial: Trial, least: float, steady: float, vague: float, sure: bool) -> str:
    """Say why a draft does not fit, or return ""."""
    if vague:
        return (
            f"nothing fits these data: no target moves steadily but for errors of {vague:,.0f} m, as large as their spread"
        )
    if not trial.tracks:
        return "nothing fits these data: no track was confirmed in them"
    if trial.share < least:
        told = f"its tracks explain {trial.share:.2g} of the returns, and steady motion {steady:.2g}"
        return f"nothing fits these data: {told}"
    many = trial.short > 0.5 * trial.tracks and SHORT * trial.short > BITS * trial.explained
    if many and trial.tracks > 3 and not sure:  # what is named so may report seldom
        return f"nothing fits these data: {trial.short} of {trial.tracks} tracks have fewer than {SHORT} returns"
    return ""
