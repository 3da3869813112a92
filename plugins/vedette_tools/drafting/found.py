"""What the returns of a table tell of its sensors and targets: facts of each sensor, and the design that is tried first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from attrs import evolve, frozen

from vedette.types import Scan
from vedette_report.detector_errors.in_time import Compared, Path, compared
from vedette_tools.drafting.chains import unbroken
from vedette_tools.drafting.design import WIDE, Design, Facts
from vedette_tools.drafting.height_and_rate import third_noise
from vedette_tools.drafting.noise import plausible
from vedette_tools.drafting.reading import JUMP, SURER, Reading
from vedette_tools.drafting.reports import longest_waits
from vedette_tools.drafting.seen import Seen, usual_speed
from vedette_tools.drafting.sights import view_of
from vedette_tools.drafting.table import AID
from vedette_tools.drafting.text import written

SELDOM = 0.1
"""Some targets report so many times as often as those do that report seldom among the first. By hand, on AIS."""

TRUE = 0.999
"""The part of the positions that objects report of themselves which are of an object: nothing else sends any. By hand,
chosen on the ships with odd numbers of one recording, in the order of their names.
"""

EXACT = 1e-4
"""Noise over a usual step of a target, below which no sensor measured. By hand: of a receiver's own filter it is .005, of a
truth with three decimals .00003.
"""

LEAST_THIRD = 1e-6
"""Of a height or a range rate an error is at least so large, in its unit, or over all their spread where that is smaller."""

WANDERS = 30.0
"""Errors that last longer than so many scans are not told from motion. Chosen by hand."""


@frozen(eq=False)
class Found:
    """What was found in a table, and the first design; `steady`: targets accelerate less than can be told."""

    best: Reading
    facts: Mapping[str, Facts]
    first: Design
    steady: bool

    @classmethod
    def of(cls, best: Reading) -> Found:
        """Return what the returns tell; names, too, if they are an aid."""
        facts = {name: _facts(best, name, best.table.of(name).reported) for name in best.seen}
        accels = [best.noise[name].accel for name, seen in best.seen.items() for _ in seen.chains]
        accel, floor = float(np.median(accels)) if accels else 0.1, min(seen.least_accel for seen in best.seen.values())
        floored = max(accel, floor)
        speed, period = usual_speed(best.seen.values()), min(seen.period for seen in best.seen.values())
        named = bool(best.table.identity) and best.table.use == AID
        first = Design(floored, speed, found=floored, sharp=speed / sqrt(period), sure=named)
        if errors := _correlated(best):
            facts = {name: evolve(one, errors=errors) for name, one in facts.items()}
            felt = max(errors.correlated.accel, *(seen.least_felt for seen in best.seen.values()))
            first = evolve(first, accel=felt, correlated=True, gate=WIDE)
        if named:
            facts = {name: _by_names(one, name, best.recording.scans) for name, one in facts.items()}
        return cls(best, facts, first, accel < floor)

    def text(self, design: Design, said: Sequence[str] = ()) -> str:
        """Return the config of a design."""
        steady = self.steady and design.accel == self.first.accel
        return written(self.best.table, self.facts, design, self.best.recording.notes, steady=steady, said=said)


def _correlated(best: Reading) -> Compared | None:
    """Return how the errors of the sensor go on from return to return, if they do: of one sensor that measures places."""
    seen, *others = best.seen.values()
    if others or best.table.polar or best.table.third or best.table.reported or seen.in_turn:
        return None
    pieces = [piece for chain in seen.chains for piece in unbroken(chain, JUMP * seen.rough)]
    comparison = compared([Path(piece.times, piece.spots[:, axis]) for piece in pieces for axis in (0, 1)])
    return (
        comparison
        if comparison is not None and comparison.wins and comparison.correlated.tau < WANDERS * seen.period
        else None
    )


def _facts(best: Reading, name: str, reported: bool) -> Facts:
    seen, noise = best.seen[name], best.noise[name].sensor
    scans = [scan for scan in best.recording.scans if scan.sensor == name]
    z = np.concatenate([scan.detections.z for scan in scans])
    farthest = np.max(np.abs(z), axis=0, initial=0.0)  # of all scans, not only of the first that tell the noise
    steps = [np.linalg.norm(np.diff(chain.spots, axis=0), axis=-1) for chain in seen.chains]
    hits, looks = sum(len(chain.times) for chain in seen.chains), sum(chain.looks for chain in seen.chains)
    every = np.concatenate(seen.spots)
    probability = _detected(seen, hits, looks)
    low, high = np.percentile(every, [1, 99], axis=0) if len(every) else (np.zeros(2), np.ones(2))
    sigmas = plausible(noise, float(np.max(high - low)))
    others = np.concatenate(seen.thirds) if seen.thirds else np.zeros(1)
    smallest = SURER if reported else LEAST_THIRD * (min(float(np.ptp(others)), 1.0) or 1.0)
    least = max(smallest, best.table.roundings.get(best.table.third, 0.0))
    third = max(third_noise(seen.chains, seen.thirds), least) if seen.thirds else 0.0
    each = len(every) / max(len(seen.times), 1)
    clutter = max((len(every) - hits) / max(len(seen.times), 1), 0.05 * min(1.0, each))
    return Facts(
        sigmas=sigmas,
        probability=probability,
        clutter=(1 - TRUE) * each if reported and seen.in_turn else clutter,
        reach=max(float(farthest[0]), 1.0),
        area=float(np.prod(np.maximum(high - low, 10 * sigmas[0]))),
        period=seen.period,
        scans=len(seen.times),
        of=len(scans),
        chains=len(seen.chains),
        third=third,
        fastest=float(farthest[-1]),
        height=float(max(np.ptp(np.percentile(others, [1, 99])), 10 * third)) if len(others) else 1.0,
        in_turn=seen.in_turn,
        exact=bool(steps) and noise[0] < EXACT * float(np.median(np.concatenate(steps))),
        view=view_of(best, name, z, probability),
    )


def _by_names(facts: Facts, sensor: str, scans: Sequence[Scan]) -> Facts:
    """Return the facts with what names tell: for how long they wait, and of targets that report in turn how seldom some do,
    and how many are new.
    """
    given = [(scan.time, scan.detections.identity) for scan in scans if scan.sensor == sensor]
    named = [codes for _, codes in given if codes is not None]
    times = np.array([time for time, codes in given if codes is not None])
    if not named or not len(waits := longest_waits(named, times)):
        return facts
    facts = evolve(facts, longest=float(np.max(waits)))
    if not facts.in_turn:
        return facts
    often = float(np.clip(1.0 / np.percentile(longest_waits(named, np.arange(len(named))), 95), 1e-6, 0.5))
    new = len(np.unique(np.concatenate(named))) / len(named)
    return evolve(facts, probability=often, clutter=max(facts.clutter, new), named=True)


def _detected(seen: Seen, hits: int, looks: int) -> float:
    """Return the probability that a scan detects a target.

    Of targets that report in turn, a tenth of that by the longest waits: those that report seldom must not be given up.
    """
    if seen.in_turn:
        waits = np.concatenate([np.diff(chain.scans) for chain in seen.chains])
        return float(np.clip(SELDOM / np.percentile(waits, 95), 1e-4, 0.5))
    return float(np.clip(hits / looks, 0.3, 0.99)) if looks else 0.9
