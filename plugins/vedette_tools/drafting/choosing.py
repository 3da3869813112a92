"""Which of the ways to read a table returns bear out: the platform, scans left out, places of sensors, heights, rates."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette_files import NORTH_EAST
from vedette_tools.drafting.cadence import left_out_period
from vedette_tools.drafting.height_and_rate import UNSURE, VELOCITY, own_share, recedes, third_noise
from vedette_tools.drafting.reading import Reading, opened, read
from vedette_tools.drafting.several import FLAT, stand
from vedette_tools.drafting.table import Table
from vedette_tools.drafting.titles import meaning

SURE = 10.0
"""Another reading must be likelier by this, in logarithms, than the one that the titles suggest."""


def stood(best: Reading) -> tuple[Reading, str]:
    """Return the reading with the sensors where they stand, where others report positions, and what hinders that, or "".

    Ranges and bearings are around the platform. Of one that no column tells, the returns say where it stands: they lie where
    objects report to be. What reports call x and y is tried both ways where bearings run from north.
    """
    table = best.table
    if not table.others:
        return best, ""
    polar = [name for name in best.seen if name not in table.others]
    readings = [best, *map(read, _turned(table))]
    told = [{name: it for name in polar if (it := _agreed(one, name)) is not None} for one in readings]
    best, agreed = max(zip(readings, told, strict=True), key=lambda pair: sum(share for _, share in pair[1].values()))
    flat = all(set(each) == set(FLAT) for each in table.others.values())
    if table.platform or (flat and not agreed):
        return best, ""
    if missing := [name for name in polar if name not in agreed]:
        why = f"no column tells where {' and '.join(missing)} stands, and no returns lie where objects report to be"
        return best, f"nothing fits these data: {why}; give a file of its positions: --platform FILE"
    said = [
        f"{name} stands at x = {x:.0f}, y = {y:.0f} m, for so {share:.0%} of the reports have a return"
        for name, ((x, y), share) in agreed.items()
    ]
    stands = {name: (round(float(x), 1), round(float(y), 1)) for name, ((x, y), _) in agreed.items()}
    return read(evolve(best.table, stands=stands, assumed=(*best.table.assumed, *said))), ""


def _turned(table: Table) -> Iterator[Table]:
    """Yield the table with x and y of the reports the other way round, if bearings run from north and titles do not tell."""
    flat = {name: each for name, each in table.others.items() if set(each) == set(FLAT)}
    if flat and table.frame == NORTH_EAST and all(meaning(each["x"]).axis in FLAT for each in flat.values()):
        turned = {name: dict(zip(FLAT, (each["y"], each["x"]), strict=True)) for name, each in flat.items()}
        yield evolve(table, others={**table.others, **turned})


def _agreed(reading: Reading, name: str) -> tuple[Array, float] | None:
    """Return where a sensor's returns say that it stands, by the positions that objects report, and how many agree."""
    reports = [chain for other in reading.table.others for chain in reading.seen[other].chains]
    seen = reading.seen[name]
    width = max(
        3.0 * seen.error if seen.chains else 0.0, *(reading.seen[other].error for other in reading.table.others), 1.0
    )
    return stand(reports, seen.times, seen.spots, width) if reports and np.isfinite(width) else None


def gapless(best: Reading) -> Reading:
    """Return the reading with the scans that the file leaves out for want of returns, if its times show such.

    The targets must still be seen: of reports that come one by one, none is a look at all targets.
    """
    counted = {name: (seen.times, [len(places) for places in seen.spots]) for name, seen in best.seen.items()}
    periods = {name: period for name, scans in counted.items() if (period := left_out_period(*scans)) is not None}
    if not periods:
        return best
    told = "gaps of whole periods are scans without returns, which the file leaves out"
    table = evolve(best.table, periods=periods, assumed=(*best.table.assumed, told))
    filled = Reading.of(table, opened(table))
    return filled if filled.followed >= 0.95 * best.followed else best


def useless(best: Reading) -> str:
    """Say why what is measured beside a position cannot be drafted, or return ""."""
    sensors = [seen for name, seen in best.seen.items() if name not in best.table.others]
    if not all(len(seen.chains) and np.isfinite(third_noise(seen.chains, seen.thirds)) for seen in sensors):
        return "no track was found that tells its noise"
    if best.table.third != "range_rate":
        return ""
    shares = [own_share(seen.chains, seen.thirds, seen.stands) for seen in sensors]
    moves = set(VELOCITY) & set(best.table.platform)
    if not moves and any(share > 0.5 or error > UNSURE for share, error in shares if error):
        return "it needs the velocity of the platform, which no column tells"
    if not all(recedes(seen.chains, seen.thirds, seen.stands, relative=not taken_out(best)) for seen in sensors):
        return "it falls where ranges grow, and a range rate must rise; turn its sign and draft anew"
    return ""


def taken_out(best: Reading) -> bool:
    """Return whether range rates are clearly without the platform's own motion."""
    rated = [seen for name, seen in best.seen.items() if name not in best.table.others]
    shares = [own_share(seen.chains, seen.thirds, seen.stands) for seen in rated]
    return all(share < 0.5 and 0 < error < UNSURE for share, error in shares)


def likeliest(first: Reading) -> Reading:
    """Return the reading of the platform's columns by which the returns are likeliest: targets hardly accelerate."""
    best = first
    for other in _readings(first.table):
        reading = Reading.of(other, opened(other))
        if reading.evidence > best.evidence + SURE:
            best = reading
    return best


def _readings(table: Table) -> Iterator[Table]:
    """Yield the other ways to read a platform: bearings from north instead of the bow, x and y the other way round."""
    if not table.platform:
        return
    swapped = dict(table.platform)
    plainly = set(FLAT) <= set(swapped) and all(meaning(swapped[axis]).axis in FLAT for axis in FLAT)
    if plainly:  # else the titles say which is which: north, latitude
        for one, other in (("x", "y"), ("vx", "vy")):
            if one in swapped and other in swapped:
                swapped[one], swapped[other] = swapped[other], swapped[one]
        yield evolve(table, platform=swapped, frame=NORTH_EAST)
    if "heading" in table.platform:
        for platform in (table.platform, swapped) if plainly else (table.platform,):
            plain = {axis: title for axis, title in platform.items() if axis != "heading"}
            frame = table.frame if platform is table.platform else NORTH_EAST
            yield evolve(table, platform=plain, frame=frame, left_out=(*table.left_out, table.platform["heading"]))
