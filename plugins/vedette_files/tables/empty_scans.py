"""Scans that a recording omits because they held no return."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vedette import Array, Detections, Pose, Scan, Space

TOLERANCE = 0.1
"""Greatest deviation of the filled scans' spacing from the period, as a fraction of it."""

MOST = 1000
"""A gap of more periods than this is a pause of the recording."""

HEADING = Space.of(heading="rad mod 2pi")


def fill_gaps(scans: list[Scan], period: float) -> list[Scan]:
    """Add scans without returns in each gap of two or more whole periods between the scans of one sensor, in time order.

    They are spread evenly over the gap, with interpolated poses. A gap that is not a whole multiple of `period`
    in s is left as it is: the sensor paused, or the period is wrong.
    """
    filled = scans[:1]
    for before, after in pairwise(scans):
        gap = after.time - before.time
        periods = round(gap / period)
        if 2 <= periods <= MOST and abs(gap / periods - period) <= TOLERANCE * period:
            filled += [_between(before, after, i / periods) for i in range(1, periods)]
        filled.append(after)
    return filled


def _between(before: Scan, after: Scan, part: float) -> Scan:
    nothing = Detections.of([], before.detections.z.shape[-1])
    time = before.time + part * (after.time - before.time)
    if before.pose is None or after.pose is None:
        return Scan(time, before.sensor, nothing)
    first, second = before.pose, after.pose
    turn = HEADING.difference(np.array([second.heading]), np.array([first.heading]))
    velocity = None
    if first.velocity is not None and second.velocity is not None:
        velocity = _mix(first.velocity, second.velocity, part)
    pose = Pose(
        _mix(first.position, second.position, part),
        velocity,
        float(HEADING.displace(np.array([first.heading]), part * turn)[0]),
    )
    return Scan(time, before.sensor, nothing, pose)


def _mix(a: Array, b: Array, part: float) -> Array:
    return a + part * (b - a)
