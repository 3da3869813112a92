"""A config for a table of detections: columns and units by its header, noise and rates by its rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import process_time

import numpy as np
from attrs import evolve, frozen

from vedette.errors import InputError
from vedette.progress import Progress, silent
from vedette.types import Recording, Scan
from vedette_files.tables.columnar import TablePath
from vedette_tools.drafting.choosing import gapless, likeliest, stood, taken_out, useless
from vedette_tools.drafting.clumps import clumped
from vedette_tools.drafting.design import Design, rounded
from vedette_tools.drafting.doubtful import one_moment
from vedette_tools.drafting.doubts import doubt
from vedette_tools.drafting.found import Found
from vedette_tools.drafting.held import cut, held, held_on_its_way
from vedette_tools.drafting.measures import ANGLES, SPEEDS
from vedette_tools.drafting.proof import BUDGET, CLEAN, LESS, Proof, proved
from vedette_tools.drafting.reading import Reading, midst, opened
from vedette_tools.drafting.recognising import NO_WISHES, read_table
from vedette_tools.drafting.regions import FEW, Region, beyond, regions
from vedette_tools.drafting.regions import told_of as told_of_regions
from vedette_tools.drafting.seen import Seen
from vedette_tools.drafting.table import AID, Table
from vedette_tools.drafting.trial import SHORT, Trial, at_the_end, tried
from vedette_tools.drafting.unread import UNREAD, readable, told_of
from vedette_tools.drafting.wishes import Wishes

MANY = 0.05
"""Such a part of the rows is many to leave out. By hand."""

ABSURD = 500.0
"""m: positions are never so wrong that a larger error explains what else has none. Chosen by hand."""

FASTEST = 3000.0
"""m/s: hardly anything that is tracked is faster. By hand."""

PROVEN, LOOKS = 8000, 6000
"""On so many returns of so many scans a draft is tried: in fewer, hardly any target turns as all do at some time."""

HELD, DOUBTED = 2.0, 2000
"""Returns in clumps are of one object where, joined, so many times as large a part of them is in chains, or where tracks
share them, by so many of them. Chosen by hand.
"""

FEWEST = 4 * SHORT
"""Of fewer scans a part of the area is tried: tracks are not to be short for want of scans. Chosen by hand."""


@frozen
class Draft:
    """A commented config, as TOML, and in one sentence why it does not fit its data, "" if it does.

    others: where further origins lie, of rows that one plane does not reach.
    """

    text: str
    failure: str
    others: tuple[Region, ...] = ()


def draft_config(path: TablePath) -> str:
    """Return a commented config, as TOML, that tracks the targets of a CSV or Parquet file, or of a data frame."""
    return drafted(path).text


def drafted(path: TablePath, use: str = AID, wishes: Wishes = NO_WISHES, progress: Progress = silent) -> Draft:
    """Return a config that tracks the targets of a CSV or Parquet file, or of a data frame.

    use: what names of objects are to it, "aid", "truth" or "ignore"; wishes: what need not be guessed. InputError if the
    file has no header, or no column that looks like a time or a position.
    """
    begun = process_time()
    best, lost, others = _read(path, use, wishes)
    best = _joined(best)
    scans, steady = best.recording.scans, best.followed / max(best.returns, 1)
    found = Found.of(best)
    in_turn = any(one.in_turn and not one.named for one in found.facts.values())
    clean = steady >= CLEAN or in_turn
    found, some, known = _with_noise_that_helps(found, _some(best.table, scans), clean=clean)
    vague = max(_vague(seen, found.facts[name].sigmas[0]) for name, seen in best.seen.items())
    proof = proved(
        found.first, lambda one: known[one] if one in known else tried(found.text(one), some, clean=clean), steady,
        errors=not best.table.reports, in_turn=in_turn, lone=best.lone, vague=vague, progress=progress,
        budget=max(BUDGET - (process_time() - begun), 0.0),
    )  # fmt: skip
    if process_time() - begun <= BUDGET:
        found = _as_often_as_tracked(found, proof, some)
    best = found.best
    polled = "" if best.lone else held_on_its_way(best)
    lost = lost or best.table.unknown or held(best) or cut(best) or _too_fast(best.table, found.first.speed)
    if not (lost or proof.failure or proof.trial is None or found.first.sure or best.table.third == "range_rate"):
        lost = doubt(found.text(proof.design), some)
    later = ""
    if proof.trial is not None and len(some) < len(scans) and not (lost or proof.failure):
        later = at_the_end(found.text(proof.design), (proof.trial, len(some)), _some(best.table, scans[::-1])[::-1])
    warned = *_unread(best.recording, others), *best.recording.warnings, polled, later
    odd = (f"looks wrong: {said}" for said in warned if said)
    said = (*((lost,) if lost else ()), *odd, *proof.said, *_partly(some, scans))
    return Draft(found.text(proof.design, said), lost or proof.failure, tuple(others))


def _unread(recording: Recording, others: Sequence[Region]) -> Iterator[str]:
    """Yield how many rows are left out, if they are many."""
    rows, far = recording.rows["detections"], beyond(recording) if others else 0
    if others:
        yield told_of_regions(others, far, rows.total)
    if (lost := rows.refused - far) > MANY * rows.total:
        yield f"{lost:,} of {rows.total:,} rows are left out, as is said below"


def _read(path: TablePath, use: str, wishes: Wishes) -> tuple[Reading, str, list[Region]]:
    """Return the way to read a table that its returns bear out, why nothing fits them, or "", and its other regions."""
    table, recording, others = _reached(read_table(path, use, wishes))
    rows, moments = recording.rows["detections"], {scan.time for scan in recording.scans}
    if rows.total > 1 == len(moments) and all(scan.detections.time is None for scan in recording.scans):
        raise one_moment(f"{table.path or path}: {table.time.title}", f"{moments.pop():.15g}")
    if rows.refused:
        told = f"{rows.refused} of {rows.total} rows cannot be read{told_of(recording.refused)}"
        if rows.refused - (beyond(recording) if others else 0) > UNREAD * rows.total:
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
    return *stood(best), others


def _joined(best: Reading) -> Reading:
    """Return the reading with an object's returns as one, if they come in clumps, and single ones are not to be tracked.

    Then chains leave most of them, or what tracks take is doubted; targets that fly together are tracked as they are.
    """
    table = best.table
    scanning = {name: seen for name, seen in best.seen.items() if not (seen.in_turn or name in table.reports)}
    if table.identity or cut(best):
        return best
    links = {name: rounded(link) for name, seen in scanning.items() if (link := clumped(seen.spots)) is not None}
    if not links:
        return best
    after, said = opened(evolve(table, links=links)), []
    for name, link in links.items():
        each = _returns(best.recording, name) / max(_returns(after, name), 1)
        told = f"objects give several returns a scan, on average {each:.2g}"
        said.append(f"{name}: {told}: those within {link:g} m are of one")
    joined = Reading.of(evolve(table, links=links, assumed=(*table.assumed, *said)), after)
    if joined.followed / max(joined.returns, 1) > HELD * best.followed / max(best.returns, 1):
        return joined
    found, scans = Found.of(best), best.recording.scans
    count = int(np.searchsorted(np.cumsum([len(scan.detections.z) for scan in scans]), DOUBTED))
    return joined if doubt(found.text(found.first), scans[: count + 1]) else best


def _returns(recording: Recording, sensor: str) -> int:
    """Return how many returns a sensor gave."""
    return sum(len(scan.detections.z) for scan in recording.scans if scan.sensor == sensor)


def _reached(table: Table) -> tuple[Table, Recording, list[Region]]:
    """Open a table around an origin whose plane reaches most of its rows, and return the other regions, too."""
    try:
        table, recording = readable(table)
    except InputError:  # the plane may reach none
        if not (found := regions(table) if "latitude" in table.measured else []):
            raise
    else:
        if beyond(recording) <= FEW * recording.rows["detections"].total:
            return table, recording, []
        found = regions(table)
    first, *others = found
    return *readable(evolve(table, origin=first[0])), others


def _with_noise_that_helps(
    found: Found, some: Sequence[Scan], *, clean: bool
) -> tuple[Found, Sequence[Scan], dict[Design, Trial | None]]:
    """Return what was found, and the scans, without errors of each return if they are likelier so; and the trial of it."""
    if not found.best.table.noise:
        return found, some, {}
    bare = [evolve(scan, detections=evolve(scan.detections, noise=None)) for scan in some]
    common = tried(found.text(found.first), bare, clean=clean)
    if common is None:
        return found, some, {}
    own = tried(found.text(found.first), some, clean=clean)
    if own is not None and own.loglik >= common.loglik:
        return found, some, {found.first: own}
    best = evolve(found.best, table=found.best.table.without_noise())
    return evolve(found, best=best), bare, {found.first: common}


def _as_often_as_tracked(found: Found, proof: Proof, some: Sequence[Scan]) -> Found:
    """Return it with the detection probability that the tracks of a design tell, if these become no worse by it.

    A name that is wrong or lacking breaks a chain, not a track.
    """
    if not found.first.sure or proof.trial is None or len(found.facts) > 1:
        return found
    often = float(np.clip(proof.trial.detected, 0.3, 0.99))
    other = evolve(
        found, facts={name: evolve(one, probability=often) for name, one in found.facts.items() if not one.in_turn}
    )
    if not other.facts:
        return found
    again = tried(other.text(proof.design), some)
    if again is None or again.share < (1 - LESS) * proof.trial.share or again.broken > 1.1 * proof.trial.broken + 0.5:
        return found
    return other


def _partly(some: Sequence[Scan], scans: Sequence[Scan]) -> tuple[str, ...]:
    """Say on which part of the returns a draft was tried, if not on all of those scans."""
    part = sum(len(scan.detections.z) for scan in some) / sum(len(scan.detections.z) for scan in scans[: len(some)])
    told = f"  on {part:.2g} of the returns of {len(some)} scans, in the midst: so many come at a time"
    return (told,) if part < 1 else ()


def _too_fast(table: Table, speed: float) -> str:
    """Say that targets are faster than any, in a unit that is guessed; or return ""."""
    lengths = [axis for axis in table.measured if axis not in (*ANGLES, *SPEEDS, *table.units)]
    guessed = [axis for axis in lengths if table.measured[axis] in table.guessed]
    if not guessed or speed < FASTEST:
        return ""
    units = ",".join(f"{axis}=0.001 m" for axis in guessed)
    told = f"targets move at some {speed:,.0f} m/s; say in what unit positions are"
    return f"nothing fits these data: {told}, as --units '{units}' of mm"


def _some(table: Table, scans: Sequence[Scan]) -> Sequence[Scan]:
    """Return the first scans, as many as a draft is tried on; of too many returns at a time those in the midst."""
    total = np.cumsum([len(scan.detections.z) for scan in scans[:LOOKS]])
    count = int(np.searchsorted(total, PROVEN, side="right"))
    return scans[:count] if count >= min(FEWEST, len(scans)) else midst(table, scans[:FEWEST], PROVEN)


def _vague(seen: Seen, sigma: float) -> float:
    """Return the error of a position, in m, if it is absurd; else 0."""
    spread = float(np.max(np.std(np.concatenate(seen.spots), axis=0), initial=0.0))
    return sigma if sigma > max(ABSURD, spread / 3) else 0.0
