"""Latitudes and longitudes as positions around the middle of each object's path, and back exactly."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices

EQUATOR, FLATTENING = 6378137.0, 1 / 298.257223563
"""Radius in m, and flattening, of the ellipsoid WGS 84."""

POLE = 89.9
"""deg: beyond, a degree of longitude is taken to be as long as here."""


@frozen(eq=False)
class Plane:
    """How long a degree is around the middle (o, 2) of each object's longitudes and latitudes."""

    middle: Array

    @classmethod
    def of(cls, places: Array, starts: Indices) -> tuple[Plane, Array]:
        """Return the plane of each object, and its places (n, 2) in deg without jumps of 360; an object's rows follow
        one another from its start.
        """
        steady = places.copy()
        longitude = steady[:, 0]
        turn = np.diff(longitude, prepend=longitude[:1])
        turn[starts[:-1]] = 0.0
        turns = np.cumsum(-360.0 * np.rint(turn / 360.0))
        whose = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
        steady[:, 0] += turns - turns[starts[:-1]][whose]
        middle = (np.minimum.reduceat(steady, starts[:-1]) + np.maximum.reduceat(steady, starts[:-1])) / 2
        return cls(middle), steady

    def to_plane(self, places: Array, whose: Indices) -> Array:
        """Return east and north (n, 2) in m of longitudes and latitudes in deg."""
        return (places - self.middle[whose]) * _lengths(self.middle[:, 1])[whose]

    def from_plane(self, spots: Array, whose: Indices) -> Array:
        """Return longitudes, from -180 to 180, and latitudes (n, 2) in deg."""
        places = self.middle[whose] + spots / _lengths(self.middle[:, 1])[whose]
        places[:, 0] = (places[:, 0] + 180.0) % 360.0 - 180.0
        return np.asarray(places)

    def stretch(self, latitudes: Array, whose: Indices) -> Array:
        """Return by what (n, 2) the plane is longer than the ground at latitudes in deg, to east and to north."""
        return np.asarray(_lengths(self.middle[:, 1])[whose] / _lengths(latitudes))


def _lengths(latitude: Array) -> Array:
    """Return how long a degree is to east and to north, (k, 2) in m."""
    angle = np.radians(np.clip(latitude, -POLE, POLE))
    squared = FLATTENING * (2 - FLATTENING)
    w = 1 - squared * np.sin(angle) ** 2
    north = EQUATOR * (1 - squared) / w**1.5
    return np.radians(np.stack([EQUATOR * np.cos(angle) / np.sqrt(w), north], axis=-1))
