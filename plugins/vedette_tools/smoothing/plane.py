"""Latitudes and longitudes as positions around the middle of each object's path, or around a pole, and back exactly."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices, Mask
from vedette_files import curvature_radii

POLAR, DEGREE = 80.0, 111_694.0
"""deg: the plane of an object that comes nearer to a pole touches the earth there; m: a degree of latitude at a pole."""


@frozen(eq=False)
class Plane:
    """How the paths of objects (o,) lie in a plane: each around the middle (o, 2) of its longitudes and latitudes, in which
    a degree is as long as there, or around the pole that it comes near: 1 north, -1 south, 0 none.

    wide (o,): whether longitudes go to 360 instead of 180.
    """

    middle: Array
    pole: Array
    wide: Mask

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
        low, high = (extreme.reduceat(steady, starts[:-1]) for extreme in (np.minimum, np.maximum))
        pole = np.where(high[:, 1] > POLAR, 1.0, np.where(low[:, 1] < -POLAR, -1.0, 0.0))
        return cls((low + high) / 2, pole, np.maximum.reduceat(places[:, 0], starts[:-1]) > 180.0), steady

    def to_plane(self, places: Array, whose: Indices) -> Array:
        """Return east and north (n, 2) in m of longitudes and latitudes in deg, at a pole as seen on its meridian 0."""
        spots = (places - self.middle[whose]) * _lengths(self.middle[:, 1])[whose]
        rows = np.flatnonzero(self.pole[whose])
        pole, (longitude, latitude) = self.pole[whose][rows], np.radians(places[rows]).T
        distance = (90.0 - pole * np.degrees(latitude)) * DEGREE
        spots[rows] = np.stack([distance * np.sin(longitude), -pole * distance * np.cos(longitude)], axis=-1)
        return np.asarray(spots)

    def from_plane(self, spots: Array, whose: Indices) -> Array:
        """Return longitudes, from -180 to 180 or from 0 to 360, and latitudes (n, 2) in deg."""
        places = self.middle[whose] + spots / _lengths(self.middle[:, 1])[whose]
        rows = np.flatnonzero(self.pole[whose])
        pole, (x, y) = self.pole[whose][rows], spots[rows].T
        places[rows] = np.stack([np.degrees(np.arctan2(x, -pole * y)), pole * (90.0 - np.hypot(x, y) / DEGREE)], axis=-1)
        low = np.where(self.wide[whose], 0.0, -180.0)
        places[:, 0] = (places[:, 0] - low) % 360.0 + low
        return np.asarray(places)

    def turned(self, velocities: Array, longitudes: Array, whose: Indices, back: bool = False) -> Array:
        """Return velocities (n, 2) to east and north as they are in the plane, or those `back`."""
        angle = np.where(back, -1.0, 1.0) * self.pole[whose] * np.radians(longitudes)
        turned = (velocities[:, 0] + 1j * velocities[:, 1]) * np.exp(1j * angle)
        return np.stack([turned.real, turned.imag], axis=-1)

    def stretch(self, latitudes: Array, whose: Indices) -> Array:
        """Return by what (n, 2) the plane is longer than the ground at latitudes in deg, to east and to north."""
        return np.where(self.pole[whose, None], 1.0, _lengths(self.middle[:, 1])[whose] / _lengths(latitudes))


def _lengths(latitude: Array) -> Array:
    """Return how long a degree is to east and to north, (k, 2) in m."""
    angle = np.radians(np.clip(latitude, -POLAR, POLAR))
    along, across = curvature_radii(angle)
    return np.radians(np.stack([across * np.cos(angle), along], axis=-1))
