"""A small marine radar and its world."""

import numpy as np

from vedette_sim import PpiRadar, Ship
from vedette_sim.marine_synthesis import World

SMALL = PpiRadar(metres_per_pixel=6.0, range=600.0, size=202, azimuths=256, beam="3 deg", gain=0.0)


def world(radar=SMALL, **more):
    return World(radar=radar, **({"ownship": Ship(start=[0.0, 0.0], course=np.pi / 2), "vessels": {}} | more))


def within(samples, expected, sigmas=5.0):
    """Whether the mean of independent samples is as expected, to so many of its standard errors."""
    error = np.std(samples, ddof=1) / np.sqrt(len(samples))
    return abs(np.mean(samples) - expected) < sigmas * error
