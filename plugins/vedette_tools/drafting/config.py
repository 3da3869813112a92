"""A config for a table of detections: columns and units by its header, noise and rates by its rows."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from time import process_time

import numpy as np
from attrs import evolve, frozen

from vedette.errors import InputError
from vedette.progress import Progress, silent
from vedette.types import Scan
from vedette_files.tables.columnar import TablePath
from vedette_report.detector_errors.in_time import Compared, Path, compared
from vedette_tools.drafting.chains import unbroken
from vedette_tools.drafting.choosing import gapless, likeliest, stood, taken_out, useless
from vedette_tools.drafting.design import WIDE, Design, Facts
from vedette_tools.drafting.doubts import doubt
from vedette_tools.drafting.height_and_rate import third_noise
from vedette_tools.drafting.held import cut, held, held_on_its_way
from vedette_tools.drafting.measures import ANGLES, SPEEDS
from vedette_tools.drafting.noise import plausible
from vedette_tools.drafting.proof import BUDGET, CLEAN, LESS, proved
from vedette_tools.drafting.reading import JUMP, SURER, Reading, midst, opened
from vedette_tools.drafting.recognising import NO_WISHES, one_moment, read_table
from vedette_tools.drafting.reports import longest_waits
from vedette_tools.drafting.seen import Seen, usual_speed
from vedette_tools.drafting.sights import view_of
from vedette_tools.drafting.table import AID, Table
from vedette_tools.drafting.text import written
from vedette_tools.drafting.trial import SHORT, Trial, at_the_end, tried
from vedette_tools.drafting.unread import UNREAD, readable, told_of
from vedette_tools.drafting.wishes import Wishes

SELDOM = 0.1
"""Some targets report so many times as often as those do that report seldom among the first. By hand, on AIS."""

TRUE = 0.999
"""The part of the positions that objects report of themselves which are of an object: nothing else sends any. By hand,
chosen on the ships with odd numbers of one recording, in the order of their names.
"""

ABSURD = 500.0
"""m: positions are never so wrong that a larger error explains what else has none. Chosen by hand."""

EXACT = 1e-4
"""Noise over a usual step of a target, below which no sensor measured. By hand: of a receiver's own filter it is .005, of a
truth with three decimals .00003.
"""

FASTEST = 3000.0
"""m/s: hardly anything that is tracked is faster. By hand."""

LEAST_THIRD = 1e-6
"""Of a height or a range rate an error is at least so large, in its unit, or over all their spread where that is smaller."""

WANDERS = 30.0
"""Errors that last longer than so many scans are not told from motion. Chosen by hand."""

PROVEN, LOOKS = 8000, 6000
"""On so many returns of so many scans a draft is tried: in fewer, hardly any target turns as all do at some time."""

FEWEST = 4 * SHORT
"""Of fewer scans a part of the area is tried: tracks are not to be short for want of scans. Chosen by hand."""


@frozen
class Draft:
    """A commented config, as TOML, and in one sentence why it does not fit its data, "" if it does."""

    text: str
    failure: str


def draft_config(path: TablePath) -> str:
    """Return a commented config, as TOML, that tracks the targets of a CSV or Parquet file, or of a data frame."""
    return drafted(path).text


def drafted(path: TablePath, use: str = AID, wishes: Wishes = NO_WISHES, progress: Progress = silent) -> Draft:
    """Return a config that tracks the targets of a CSV or Parquet file, or of a data frame.

    use: what names of objects are to it, "aid", "truth" or "ignore"; wishes: what need not be guessed. InputError if the
    file has no header, or no column that looks like a time or a position.
    """
    begun = process_time()
    table, recording = readable(read_table(path, use, wishes))
    rows, moments = recording.rows["detections"], {scan.time for scan in recording.scans}
    if rows.total > 1 == len(moments) and all(scan.detections.time is None for scan in recording.scans):
        raise one_moment(f"{table.path or path}: {table.time.title}", f"{moments.pop():.15g}")
    if rows.refused:
        told = f"{rows.refused} of {rows.total} rows cannot be read{told_of(recording.refused)}"
        if rows.refused > UNREAD * rows.total:
            raise InputError(f"{table.path or path}: {told}")
        table = evolve(table, assumed=(*table.assumed, told))
    best = gapless(likeliest(Reading.of(table, recording)))
    table = best.table if best.table.periods else table
    if table.third and (why := useless(best)):
        table = table.without_third(why)
        best = likeliest(Reading.of(table, opened(table)))
    if best.table.third == "range_rate" and taken_out(best):
        title = best.table.measured["range_rate"]
        resting = best.table.at_rest(f"{title} is over ground: the platform's own motion is not in it")
        best = evolve(best, table=resting, recording=opened(resting))
    best, lost = stood(best)
    facts = {name: _facts(best, name, table.of(name).reported) for name in best.seen}
    accels = [best.noise[name].accel for name, seen in best.seen.items() for _ in seen.chains]
    accel, floor = float(np.median(accels)) if accels else 0.1, min(seen.least_accel for seen in best.seen.values())
    floored = max(accel, floor)
    speed, period = usual_speed(best.seen.values()), min(seen.period for seen in best.seen.values())
    named = bool(table.identity) and table.use == AID
    first = Design(floored, speed, found=floored, sharp=speed / sqrt(period), sure=named)
    if errors := _correlated(best):
        facts = {name: evolve(one, errors=errors) for name, one in facts.items()}
        felt = max(errors.correlated.accel, *(seen.least_felt for seen in best.seen.values()))
        first = evolve(first, accel=felt, correlated=True, gate=WIDE)

    def text(design: Design, said: Sequence[str] = ()) -> str:
        steady = accel < floor and design.accel == first.accel
        return written(best.table, facts, design, best.recording.notes, steady=steady, said=said)

    if named:
        facts = {name: _by_names(one, name, best.recording.scans) for name, one in facts.items()}
    some = _some(best.table, best.recording.scans)
    steady, in_turn = best.followed / max(best.returns, 1), any(one.in_turn and not one.named for one in facts.values())
    clean = steady >= CLEAN or in_turn
    bare = [evolve(scan, detections=evolve(scan.detections, noise=None)) for scan in some] if best.table.noise else []
    known: dict[Design, Trial | None] = {}
    if bare and (common := tried(text(first), bare, clean=clean)) is not None:
        known[first] = own = tried(text(first), some, clean=clean)
        if own is None or own.loglik < common.loglik:
            some, best, known[first] = bare, evolve(best, table=best.table.without_noise()), common
    vague = max(_vague(seen, facts[name].sigmas[0]) for name, seen in best.seen.items())
    proof = proved(
        first, lambda design: known[design] if design in known else tried(text(design), some, clean=clean), steady,
        errors=not table.reports, in_turn=in_turn, lone=best.lone, vague=vague, progress=progress,
        budget=max(BUDGET - (process_time() - begun), 0.0),
    )  # fmt: skip
    ended = process_time() - begun > BUDGET
    if named and proof.trial is not None and len(facts) == 1 and not ended:
        # A name that is wrong or lacking breaks a chain, not a track: the tracks know better how often targets are detected.
        often = float(np.clip(proof.trial.detected, 0.3, 0.99))
        plain = dict(facts)
        facts = {name: one if one.in_turn else evolve(one, probability=often) for name, one in plain.items()}
        again = tried(text(proof.design), some)
        if again is None or again.share < (1 - LESS) * proof.trial.share or again.broken > 1.1 * proof.trial.broken + 0.5:
            facts = plain
    polled = "" if best.lone else held_on_its_way(best)
    lost = lost or best.table.unknown or held(best) or cut(best) or _too_fast(best.table, speed)
    if not (lost or proof.failure or proof.trial is None or first.sure or table.third == "range_rate"):
        lost = doubt(text(proof.design), some)
    later = ""
    if proof.trial is not None and len(some) < len(best.recording.scans) and not (lost or proof.failure):
        later = at_the_end(text(proof.design), (proof.trial, len(some)), _some(best.table, best.recording.scans[::-1])[::-1])
    odd = tuple(f"looks wrong: {said}" for said in (*best.recording.warnings, polled, later) if said)
    part = sum(len(scan.detections.z) for scan in some) / sum(
        len(scan.detections.z) for scan in best.recording.scans[: len(some)]
    )
    partly = (
        (f"  on {part:.2g} of the returns of {len(some)} scans, in the midst: so many come at a time",) if part < 1 else ()
    )
    return Draft(text(proof.design, (*((lost,) if lost else ()), *odd, *proof.said, *partly)), lost or proof.failure)


def _too_fast(table: Table, speed: float) -> str:
    """Say that targets are faster than any, in a unit that is guessed; or return ""."""
    lengths = [axis for axis in table.measured if axis not in (*ANGLES, *SPEEDS, *table.units)]
    guessed = [axis for axis in lengths if table.measured[axis] in table.guessed]
    if not guessed or speed < FASTEST:
        return ""
    units = ",".join(f"{axis}=0.001 m" for axis in guessed)
    told = f"targets move at some {speed:,.0f} m/s; say in what unit positions are"
    return f"nothing fits these data: {told}, as --units '{units}' of mm"


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


def _some(table: Table, scans: Sequence[Scan]) -> Sequence[Scan]:
    """Return the first scans, as many as a draft is tried on; of too many returns at a time those in the midst."""
    total = np.cumsum([len(scan.detections.z) for scan in scans[:LOOKS]])
    count = int(np.searchsorted(total, PROVEN, side="right"))
    return scans[:count] if count >= min(FEWEST, len(scans)) else midst(table, scans[:FEWEST], PROVEN)


def _vague(seen: Seen, sigma: float) -> float:
    """Return the error of a position, in m, if it is absurd; else 0."""
    spread = float(np.max(np.std(np.concatenate(seen.spots), axis=0), initial=0.0))
    return sigma if sigma > max(ABSURD, spread / 3) else 0.0


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
