"""What explains best that returns lie beside targets whose places are known: a turned sensor, an offset, or late times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Indices

FARTHEST = 16.0
"""A return farther from where an explanation has it than so many squared deviations counts as if it were so far: clutter."""
CLEARLY = 10.0
"""Chi-square by which one explanation is to beat another, where the best fits; more where it does not. By hand."""
ROUNDS = 5
"""An explanation takes the nearest returns and is fitted to them, so many times."""


@frozen(eq=False)
class Looks:
    """Targets' places and velocities (l, 2) as seen from where the sensor stands, and the returns around each of them.

    apart (r, 2): a return less the target's place; precision (r, 2, 2): the inverse of its covariance; first (l,): the first
    return of each look.
    """

    places: Array
    velocities: Array
    apart: Array
    precision: Array
    first: Indices

    @classmethod
    def of(cls, looks: Sequence[tuple[Array, Array, Array, Array]]) -> Looks:
        """Join looks: place (2,), velocity (2,), and its returns less the place (k, 2) with covariances (k, 2, 2)."""
        places, velocities, apart, covs = zip(*looks, strict=True)
        first = np.cumsum([0, *(len(one) for one in apart[:-1])])
        return cls(np.array(places), np.array(velocities), np.concatenate(apart), np.linalg.inv(np.concatenate(covs)), first)

    def nearest(self, moved: Array) -> tuple[Indices, Array]:
        """Return of each look the return that is nearest to where it is moved (l, 2), and its squared distance."""
        counts = np.diff([*self.first, len(self.apart)])
        d = self.apart - np.repeat(moved, counts, axis=0)
        squares = np.einsum("ri,rij,rj->r", d, self.precision, d)
        least = np.minimum.reduceat(squares, self.first)
        rows = np.flatnonzero(squares == np.repeat(least, counts))
        owner = np.repeat(np.arange(len(self.first)), counts)[rows]
        return rows[np.searchsorted(owner, np.arange(len(self.first)))], least

    def fitted(self, basis: Array, start: Array) -> tuple[Array, float]:
        """Return parameters (p,) of returns moved by `basis` (l, 2, p) @ parameters, and the sum of squares, each at most
        `FARTHEST`; from those that are nearest to `start` (l, 2) on, of which the nearer half counts whatever it takes.
        """
        moved, found = start, np.zeros(basis.shape[-1])
        for _ in range(ROUNDS):
            rows, squares = self.nearest(moved)
            near = squares <= max(FARTHEST, float(np.median(squares)))
            B, P, d = basis[near], self.precision[rows[near]], self.apart[rows[near]]
            A = np.einsum("lip,lij,ljq->pq", B, P, B)
            found = np.linalg.lstsq(A, np.einsum("lip,lij,lj->p", B, P, d), rcond=None)[0]
            moved = basis @ found
        return found, float(np.sum(np.minimum(self.nearest(moved)[1], FARTHEST)))


def rivals_of(looks: Looks, angle: float) -> tuple[str, ...] | None:
    """Return what explains as well as a turn by an angle, in rad, where returns lie; None if something explains it better.

    Each of a turn, an offset and a lag is given the returns that are nearest to where it has them.
    """
    turned = _turned(looks.places, angle)
    across = np.stack([-looks.places[:, 1], looks.places[:, 0]], axis=-1)[..., None]
    _, by_turn = looks.fitted(across, turned)
    offset, by_offset = looks.fitted(np.broadcast_to(np.eye(2), (len(turned), 2, 2)), turned)
    lag, by_lag = looks.fitted(-looks.velocities[..., None], turned)
    costs = [by_turn, by_offset + np.log(len(turned)), by_lag]
    margin = CLEARLY * max(1.0, min(costs) / (2 * len(turned)))
    if by_turn > min(costs) + margin:
        return None
    said = (
        f"{offset[0]:+.3g} m along x and {offset[1]:+.3g} m along y from these",
        f"where they were {abs(lag[0]):.2g} s {'earlier' if lag[0] > 0 else 'later'}",
    )
    return tuple(one for one, cost in zip(said, costs[1:], strict=True) if cost < by_turn + margin)


def _turned(places: Array, angle: float) -> Array:
    """Return by how much places (l, 2) move when they are turned about the origin."""
    c, s = np.cos(angle) - 1.0, np.sin(angle)
    return places @ np.array([[c, s], [-s, c]])
