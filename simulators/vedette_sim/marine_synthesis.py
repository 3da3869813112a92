"""The power received in each turn of a marine radar's antenna, and the pictures made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import final

import numpy as np
from attrs import define, field, frozen

from vedette import Array
from vedette_sim import ppi_display as display
from vedette_sim.marine_hull import Vessel
from vedette_sim.marine_surroundings import Buoy, Land, LandRaster, Racon, Rain
from vedette_sim.polar_fields import Float32, TextureMemory, Upsampling, opencv, own_stream
from vedette_sim.ppi import PpiRadar, Raster
from vedette_sim.sea import SeaClutter
from vedette_sim.ships import Ship

SPECKLE, TEXTURE, LAND, BUOY, VESSEL = range(5)
"""Numbers of the random streams."""

_PATCH = (8, 16)
"""Sweeps and range bins between independent values of the sea's texture, before smoothing."""

_RAIN = (4, 16)
"""Sweeps and bins between the points where rain is computed; linear in between."""


def still(at: Array) -> Callable[[float], Array]:
    """Return the path of something that does not move."""
    return lambda time: at


@final
@frozen
class World:
    """What surrounds the radar."""

    radar: PpiRadar
    ownship: Ship
    vessels: Mapping[str, Vessel]
    sea: SeaClutter | None = None
    lands: tuple[Land, ...] = ()
    rains: tuple[Rain, ...] = ()
    buoys: tuple[Buoy, ...] = ()
    racons: tuple[Racon, ...] = ()

    def bow(self, times: Array) -> Array:
        """Return own ship's heading clockwise from north, not wrapped (*s)."""
        return 0.5 * np.pi - self.ownship.heading(times)

    def sighted(self, turn: int, where: Callable[[float], Array]) -> tuple[float, float, Array]:
        """Return when turn `turn` sweeps over where(time) (2,), its azimuth then, and its position from the antenna (2,)."""
        period = self.radar.period
        time = (turn + 0.5) * period
        for _ in range(4):
            _, x, y, course, _ = self.ownship.at(np.array(time))
            away = where(time) - np.array([x, y])
            azimuth = float(np.mod(np.arctan2(away[0], away[1]) - (0.5 * np.pi - course), 2.0 * np.pi))
            time = (turn + azimuth / (2.0 * np.pi)) * period
        return time, azimuth, away


@final
@define(eq=False)
class Synthesis:
    """Turns and pictures of a world, each a function of its number, its time and the seed alone.

    The last two turns are cached; this saves time where the antenna's period is longer than a picture's interval.
    """

    world: World
    seed: int
    _speckle: Upsampling = field(init=False)
    _texture: Upsampling = field(init=False)
    _memory: TextureMemory | None = field(init=False, default=None)
    _land: LandRaster | None = field(init=False, default=None)
    _still: Float32 | None = field(init=False, default=None)
    _turns: dict[int, Float32] = field(init=False, factory=dict)
    _raster: Raster = field(init=False)

    def __attrs_post_init__(self) -> None:
        radar, sea = self.world.radar, self.world.sea
        self._raster = Raster(radar)
        bins = len(radar.ranges)
        # Interpolating two cells linearly is a triangle of variance 2/3; the Gaussian supplies the rest of the beam's width.
        rest = [float(np.sqrt(max(2.0 * spread**2 - 2.0 / 3.0, 0.01))) for spread in radar.spread]
        self._speckle = Upsampling((radar.azimuths // 2, -(-bins // 2)), (2, 2), (rest[0], rest[1]))
        self._texture = Upsampling((radar.azimuths // _PATCH[0], -(-bins // _PATCH[1])), _PATCH)
        if sea is not None:
            rho = float(np.exp(-radar.period / sea.seconds))
            self._memory = TextureMemory(self._texture.coarse, rho, self.seed, TEXTURE)

    def lay_land(self, last: float) -> None:
        """Make the raster of the land as far as own ship goes until `last` s. ValueError if it is too large."""
        if self.world.lands:
            way = self.world.ownship.states(np.linspace(0.0, last, 200))[:, :2]
            box = np.array([way.min(axis=0), way.max(axis=0)])
            self._land = LandRaster(self.world.lands, self.world.radar, box, self.seed, LAND)
            if np.all(box[0] == box[1]) and np.ptp(self.world.bow(np.linspace(0.0, last, 200))) == 0:
                self._still = self._land.mean(box[0], self.world.radar.bearings + float(self.world.bow(np.array(0.0))))

    def times(self, turn: int) -> Array:
        """Return the time of each sweep of a turn (azimuths,)."""
        radar = self.world.radar
        return (turn + (np.arange(radar.azimuths) + 0.5) / radar.azimuths) * radar.period

    def mean(self, turn: int) -> Float32:
        """Return the mean power of all extended echoes relative to the noise's: noise, sea, land, rain."""
        world, radar, sea = self.world, self.world.radar, self.world.sea
        middle = (turn + 0.5) * radar.period
        times = self.times(turn)
        bearings = radar.bearings + world.bow(times)
        place = world.ownship.states(np.array(middle))[:2]
        bins = len(radar.ranges)
        if sea is not None and self._memory is not None:
            power = sea.texture(self._texture(self._memory.at(turn)))[:, :bins]
            power *= sea.rose(bearings).astype(np.float32)[:, None]
            power *= sea.mean(radar.ranges).astype(np.float32)
            power += np.float32(1.0)
        else:
            power = np.ones((radar.azimuths, bins), dtype=np.float32)
        if self._land is not None:
            power += self._still if self._still is not None else self._land.mean(place, bearings)
        if world.rains:
            power += self._rain(bearings, place, middle)
        return power

    def _rain(self, bearings: Array, place: Array, time: float) -> Float32:
        """Return the mean power of the rain (azimuths, bins)."""
        cv2, radar = opencv(), self.world.radar
        (down, across), bins = _RAIN, len(radar.ranges)
        columns = -(-bins // across)
        ranges = (np.arange(columns) + 0.5) * across * radar.cell
        middles = bearings[down // 2 :: down] - np.pi / radar.azimuths
        middles = np.concatenate([middles[-1:], middles, middles[:1]])
        x = place[0] + np.sin(middles)[:, None] * ranges
        y = place[1] + np.cos(middles)[:, None] * ranges
        coarse = np.sum([rain.profile(x, y, time) for rain in self.world.rains], axis=0).astype(np.float32)
        wide = cv2.resize(coarse, (columns * across, len(middles) * down), interpolation=cv2.INTER_LINEAR)
        fall = ((np.maximum(radar.ranges, 30.0) / 1000.0) ** -2).astype(np.float32)
        return wide[down : down + radar.azimuths, :bins] * fall

    def power(self, turn: int) -> Float32:
        """Return the power of turn 0, 1, .. relative to the noise's, sweeps from the bow clockwise (azimuths, bins)."""
        world, radar = self.world, self.world.radar
        noise = own_stream(self.seed, SPECKLE, turn).standard_normal((2, *self._speckle.coarse), dtype=np.float32)
        power = np.ascontiguousarray(self._speckle.power(noise)[:, : len(radar.ranges)])
        power *= self.mean(turn)
        for number, buoy in enumerate(world.buoys):
            _, azimuth, away = world.sighted(turn, still(buoy.at))
            seen = own_stream(self.seed, BUOY, number, turn).standard_exponential() * buoy.cross_section
            self._add(power, np.array([azimuth]), np.hypot(*away)[None], np.array([seen]))
        for name, vessel in world.vessels.items():
            self._add_vessel(power, turn, name, vessel)
        for racon in world.racons:
            time, azimuth, away = world.sighted(turn, still(racon.at))
            if racon.answers(time):
                racon.add_to(power, radar, azimuth, float(np.hypot(*away)))
        return power

    def _add_vessel(self, power: Float32, turn: int, name: str, vessel: Vessel) -> None:
        path = vessel.path
        time, _, sight = self.world.sighted(turn, lambda t: path.states(np.array(max(t, path.appears)))[:2])
        if not vessel.there(time):
            return
        places, sections = vessel.scatterers(float(path.heading(np.array(time))), sight)
        sections = sections * vessel.draw(own_stream(self.seed, VESSEL, turn, *name.encode()))
        away = sight + places
        azimuths = np.mod(np.arctan2(away[:, 0], away[:, 1]) - float(self.world.bow(np.array(time))), 2.0 * np.pi)
        self._add(power, azimuths, np.hypot(away[:, 0], away[:, 1]), sections)

    def _add(self, power: Float32, azimuths: Array, ranges: Array, sections: Array) -> None:
        radar = self.world.radar
        radar.add_points(power, azimuths, ranges, sections * radar.strength(ranges))

    def levels(self, turn: int) -> Float32:
        """Return the decibels over black of a turn, cached."""
        if turn not in self._turns:
            made = self.world.radar.levels(self.power(turn))
            self._turns = {k: v for k, v in self._turns.items() if abs(k - turn) <= 1} | {turn: made}
        return self._turns[turn]

    def sweeps(self, time: float) -> tuple[Float32, Array]:
        """Return what each azimuth last received until `time`, in decibels over black (azimuths, bins), and when."""
        radar = self.world.radar
        part = (np.arange(radar.azimuths) + 0.5) / radar.azimuths
        turns = np.floor(time / radar.period - part + 1e-9).astype(int)
        first, last = int(turns[-1]), int(turns[0])
        made = (
            self.levels(last) if first == last else np.where((turns == last)[:, None], self.levels(last), self.levels(first))
        )
        return made, (turns + part) * radar.period

    def picture(self, time: float) -> display.Picture:
        """Return the screen at `time` without colour and interface (h, w)."""
        radar, world = self.world.radar, self.world
        levels, seen = self.sweeps(time)
        up = 0.0 if radar.up == "north-up" else float(world.bow(np.array(time)))
        # Old and new meet at the azimuth that was looked at last; each has own ship's heading at its own time.
        bearings = radar.bearings + world.bow(seen) - up
        return self._raster.picture(display.quantised(display.turned(levels, bearings), radar.span))
