"""Ships as a marine radar sees them: scatterers along the side that faces it, and a superstructure."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, fields
from vedette_sim.ais import Transponder
from vedette_sim.ships import Ship

_EACH_SIDE = 20
_STERN = 3
_GRAZING = 0.04
"""Share of a plate's echo that is seen in any aspect."""


def hull(length: float, width: float) -> tuple[Array, Array, Array]:
    """Return the plates of a hull: positions and outward normals (n, 2), forward and to port of its centre, lengths (n,).

    The hull has parallel sides, a bow that tapers over the foremost third, and a flat stern.
    """
    edges = np.linspace(-0.5, 0.5, _EACH_SIDE + 1)
    half = 0.5 * (1.0 - np.clip((edges - 1.0 / 6.0) * 3.0, 0.0, 1.0) ** 2)
    side = np.column_stack([edges * length, half * width])
    across = np.linspace(-0.5, 0.5, _STERN + 1)
    stern = np.column_stack([np.full(_STERN + 1, -0.5 * length), across * width])
    places, normals, sizes = [], [], []
    for corners, turn in ((side, 1.0), (side * [1.0, -1.0], -1.0), (stern, 1.0)):
        step = np.diff(corners, axis=0)
        size = np.hypot(step[:, 0], step[:, 1])
        places.append(0.5 * (corners[1:] + corners[:-1]))
        normals.append(turn * np.column_stack([-step[:, 1], step[:, 0]]) / size[:, None])
        sizes.append(size)
    return np.concatenate(places), np.concatenate(normals), np.concatenate(sizes)


@final
@frozen
class Vessel:
    """A ship with an extent: its hull centre follows `path`, its bow points along its course.

    The superstructure has a share of the cross-section; the plates that face the radar share the rest by the cosine to the
    line of sight. The total is `cross_section` broadside, and smaller in other aspects as the hull looks shorter.
    From turn to turn the whole fluctuates as a gamma variable, and each scatterer exponentially.

    >>> ship = Vessel(Ship([0.0, 0.0], appears=5.0, disappears=9.0), 100.0, 20.0, 300.0, superstructure=0.25, bridge=-0.3,
    ...               steadiness=4.0)
    >>> where, sections = ship.scatterers(0.5, 700.0 * np.array([np.cos(1.7), np.sin(1.7)]))  # 1.2 rad off its stern
    >>> whole = 300 * np.sqrt(100**2 * np.sin(1.2) ** 2 + 20**2 * np.cos(1.2) ** 2) / 100
    >>> np.allclose([sections.sum(), sections[-1]], [whole, whole / 4])
    True
    >>> np.allclose(where[-1], [-30 * np.cos(0.5), -30 * np.sin(0.5)])
    True
    >>> fore, port = (where @ np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])).T.round(6)
    >>> right, left = (sections[(fore < 0) & (port == side)] for side in (-10, 10))
    >>> stern = sections[fore == -50]
    >>> np.allclose(right[0] / left[0], (np.sin(1.2) + 0.04) / 0.04)  # .04 is seen of any plate; a side's have 5 m
    True
    >>> np.allclose(stern[0] / right[0], 20 / 3 / 5 * (np.cos(1.2) + 0.04) / (np.sin(1.2) + 0.04))
    True
    >>> rng = np.random.default_rng(1)
    >>> each = np.array([ship.draw(rng)[:20] for _ in range(4000)])
    >>> np.allclose([each.mean(), np.mean(each**2), np.mean(each[:, 0] * each[:, 1])], [1.0, 2 * 1.25, 1.25], rtol=0.1)
    True
    >>> [ship.there(time) for time in (4.9, 5.0, 9.0, 9.1)]
    [False, True, True, False]
    """

    path: Ship = fields.part("where its hull's centre goes; x is east, y is north")
    length: float = fields.quantity("m", "of the hull", above=0, at_most=1000)
    width: float = fields.quantity("m", "of the hull", above=0, at_most=1000)
    cross_section: float = fields.quantity("m^2", "mean radar cross-section, broadside", default=250.0, above=0)
    superstructure: float = fields.probability("part of the cross-section that the superstructure has", default=0.3)
    bridge: float = fields.quantity(
        "1", "where that stands: lengths before the centre", default=-0.1, at_least=-0.5, at_most=0.5
    )
    steadiness: float = fields.quantity(
        "1", "shape of the gamma variable; large is steady", default=5.0, above=0.05, at_most=1e6
    )
    ais: Transponder | None = fields.part("its AIS transponder; default: it has none", default=None)
    _plates: tuple[Array, Array, Array] = field(
        init=False, repr=False, eq=False, default=Factory(lambda self: hull(self.length, self.width), takes_self=True)
    )

    def __attrs_post_init__(self) -> None:
        if self.width > self.length:
            raise ValueError(f"width: must be <= the length, {self.length:.6g} m, got {self.width:.6g} m")

    def scatterers(self, course: float, sight: Array) -> tuple[Array, Array]:
        """Return positions (n, 2), east and north of its centre, and mean cross-sections (n,) of the scatterers.

        `sight` (2,) points from the radar to the ship; `course` is counter-clockwise from east.
        """
        places, normals, sizes = self._plates
        cos, sin = np.cos(course), np.sin(course)
        turn = np.array([[cos, -sin], [sin, cos]])
        line = sight / max(float(np.hypot(*sight)), 1e-9)
        facing = np.maximum(-(normals @ turn.T) @ line, 0.0)
        shares = sizes * (facing + _GRAZING)
        along = abs(float(line @ [cos, sin]))
        seen = np.sqrt(self.length**2 * (1.0 - along**2) + (self.width * along) ** 2) / self.length
        total = self.cross_section * seen
        bridge = np.array([self.bridge * self.length, 0.0])
        where = np.concatenate([places, [bridge]]) @ turn.T
        return where, total * np.append((1.0 - self.superstructure) * shares / shares.sum(), self.superstructure)

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw one turn's fluctuation of each scatterer (n,), with mean 1."""
        whole = rng.gamma(self.steadiness, 1.0 / self.steadiness)
        return whole * rng.standard_exponential(len(self._plates[2]) + 1)

    def there(self, time: float) -> bool:
        """Tell whether it exists at `time`."""
        return self.path.appears <= time and (self.path.disappears is None or time <= self.path.disappears)
