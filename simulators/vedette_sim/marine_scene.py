"""Simulated radar pictures of ships as a source: frames on demand, true hull positions, and AIS reports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, cast, final

import numpy as np
from attrs import Factory, frozen
from numpy.typing import NDArray

from vedette import (
    Array,
    ConfigError,
    Frame,
    ImagingSensor,
    LazyScans,
    Recording,
    Scan,
    Sensor,
    Source,
    Space,
    Trajectory,
    fields,
)
from vedette_marine.ais import Reports, trajectories
from vedette_marine.geometry import PictureGeometry
from vedette_sim import ppi_display as display
from vedette_sim.ais import antenna_path, reports
from vedette_sim.life import life
from vedette_sim.marine_hull import Vessel
from vedette_sim.marine_surroundings import Buoy, Land, Racon, Rain, land_mask
from vedette_sim.marine_synthesis import Synthesis, World
from vedette_sim.polar_fields import own_stream
from vedette_sim.ppi import PpiRadar
from vedette_sim.sea import SeaClutter
from vedette_sim.ships import PLANE, Ship, check_ownship

LOST, AIS = 16, 17
"""Numbers of the random streams, beside those of the synthesis."""

_MOST_TURNS = 1e5
"""More turns or seconds than this are taken for a wrong unit."""

BODY = PLANE.union(Space.of(heading="rad mod 2pi", length="m", width="m"))
"""Axes of a hull's truth: its centre, and the direction of its bow counter-clockwise from east."""


@final
@frozen
class RadarPicturesScene(Source):
    """Pictures of a marine radar's screen. x is east, y is north; the pictures are 8 bit, blue, green, red (3, h, w).

    A picture at time t shows at each azimuth what the antenna saw there last. Each turn of the antenna has its own random
    streams for sea, noise, and every vessel and buoy: pictures may be requested in any order, and another vessel leaves the
    clutter as it is. The truth holds the hulls' centres; with `reference = "ais"`, the AIS antennas as reported.

    >>> radar, turned = PpiRadar(40.0, 1280.0, 64, 0.2, 60.0, 2.0, 64, echo=40.0), Ship([200.0, -100.0], course=0.4)
    >>> ship = Vessel(Ship([-500.0, -600.0], course=2.0, appears=5.0), 30.0, 6.0, 200.0, steadiness=1e5)
    >>> scene = RadarPicturesScene(
    ...     radar, {"a": ship}, frames=6, lost=2, interval=3.0, sea=SeaClutter(1e3, 12.0, wind_from=0.9, upwind=6.0),
    ...     land=(Land([[720, -3000], [3000, -3000], [3000, 3000], [720, 3000]], roughness=0.0),),
    ...     rain=(Rain([-300.0, 100.0], radius=300.0, level=25.0, drift=[20.0, 0.0]),), ownship=turned)
    >>> len(times := scene.times(3)), times[[0, 3]].tolist(), scene.truth(times, 3)[0].states[0].tolist()
    (4, [2.0, 17.0], [-500.0, -600.0, -0.0, 0.0, 2.0, 30.0, 6.0])
    >>> b, r = (radar.bearings + np.pi / 2 - 0.4)[:, None], radar.ranges  # the mean of turn 4, around 9 s
    >>> x, y = 200 + np.sin(b) * r, -100 + np.cos(b) * r
    >>> sea = 10**1.2 * (r / 1000) ** -3 * 10 ** (0.6 * np.maximum(np.cos(b - 0.9), 0) ** 2)
    >>> rain = 10**2.5 * (r / 1000) ** -2 * np.exp(-0.5 * ((x + 300 - 20 * 9) ** 2 + (y - 100) ** 2) / 300**2)
    >>> land = (x > 700) * 10**4.5 * (r / 1000) ** -3 * np.exp(-np.cumsum(x > 700, axis=1) * 20 / 600)
    >>> off = np.abs(scene.painter(3).synthesis.mean(4) / (1 + sea + rain + land) - 1)[:, 16:]
    >>> [bool(np.quantile(off[p[:, 16:]], 0.8) < 0.1) for p in (x > 700, rain > 3 * sea, (10 * rain < sea) & (x < 700))]
    [True, True, True]
    >>> calm = RadarPicturesScene(radar, {"a": ship}, buoys=(Buoy([600.0, 150.0]),), ownship=turned).painter(1).synthesis
    >>> power = np.mean([calm.power(turn) for turn in range(5, 105)], axis=0) - 1
    >>> seen = 200 * np.hypot(30 * np.sin(2.0 - np.arctan2(5, 7)), 6 * np.cos(2.0 - np.arctan2(5, 7))) / 30
    >>> for dx, dy, section in ((400.0, 250.0, 10.0), (-700.0, -500.0, seen)):  # 10^4 / R^4 over beam and pulse, where it is
    ...     i, j = (np.arctan2(dx, dy) - np.pi / 2 + 0.4) / (2 * np.pi / 64) - 0.5, np.hypot(dx, dy) / 20 - 0.5
    ...     rows, columns = np.rint(i).astype(int) + np.arange(-5, 6), np.rint(j).astype(int) + np.arange(-7, 8)
    ...     near, whole = power[np.ix_(rows % 64, columns)], section * 1e16 * np.hypot(dx, dy) ** -4
    ...     np.allclose(near.sum() / (2 * np.pi * np.prod(radar.spread)), whole, rtol=0.15)
    ...     np.allclose([near.sum(axis=1) @ rows / near.sum(), near.sum(axis=0) @ columns / near.sum()], [i, j], atol=0.15)
    True
    True
    True
    True

    A beacon's dash, 30 dB less 8, less .4 beside the beam's middle, is brightness 184 of 255, north of the ship.

    >>> for up, course, row, column in (("north-up", 0.3, 9, 31), ("head-up", 0.0, 31, 9)):
    ...     radar = PpiRadar(40.0, 1280.0, 64, 0.2, 60.0, 1.0, 64, up=up)
    ...     beacon, own = Racon([0.0, 500.0], "T", on=45.0, length=600.0), Ship([0.0, 0.0], course=course)
    ...     scene = RadarPicturesScene(radar, {"a": ship}, racons=(beacon,), ownship=own, interface=False)
    ...     blue_green_red = scene.painter(1).pixels(2.0)
    ...     np.allclose(blue_green_red[:, row, column], [72, 208, 167], atol=4), int(blue_green_red[:, :4, :4].max())
    (True, 0)
    (True, 0)

    The sea changes from turn to turn as stated, and all power from cell to cell as an exponential variable does.

    >>> waves = RadarPicturesScene(radar, {"a": ship}, sea=SeaClutter(1e3, 60.0, seconds=2.0)).painter(1).synthesis
    >>> mean, made = (np.array([part(turn)[:, 4:] for turn in range(80)]) for part in (waves.mean, waves.power))
    >>> T = mean / 1e6 * (r[4:] / 1000) ** 3 - 1
    >>> np.allclose([np.var(T) * 1e3, np.mean(T[1:] * T[:-1]) / np.var(T)], [1.0, np.exp(-0.5)], rtol=0.15)
    True
    >>> np.allclose([np.mean(made / mean > x) for x in (0.2, 1.0, 3.0)], np.exp([-0.2, -1.0, -3.0]), rtol=0.05)
    True
    >>> from vedette_sim.ais import Transponder
    >>> named = {name: Vessel(Ship([0.0, 0.0], course=4.0), 30.0, 6.0, ais=Transponder()) for name in "ab"}
    >>> plain = RadarPicturesScene(radar, named, frames=30, reference="ais", video="sweeps")
    >>> [path.name for path in plain.truth(plain.times(1), 1)], bool(plain.centres(plain.times(1))[0].states[0, 4] < 0)
    (['MMSI 211000001', 'MMSI 211000002'], True)
    >>> swept = np.array([plain.painter(1).scan(float(t), "radar").frame.pixels[:, 16:] for t in range(2, 12)])
    >>> swept.shape, np.allclose(np.mean(np.log(swept)), np.log(10**-0.8) - np.euler_gamma, atol=0.05)  # exponential, -8 dB
    ((10, 64, 48), True)
    """

    kind: ClassVar[str] = "radar_pictures_scene"

    radar: PpiRadar = fields.part("antenna, receiver and screen")
    vessels: Mapping[str, Vessel] = fields.part("name to ship")
    frames: int = fields.integer("pictures that the radar made", default=540, at_least=1, at_most=1_000_000)
    lost: int = fields.integer("how many of them, not the first nor the last, were lost on the way", default=0)
    interval: float = fields.quantity("s", "time from picture to picture", default=1.0, above=0)
    first: float | None = fields.quantity(
        "s", "time of the first picture; default: when the antenna has turned once", default=None, at_least=0
    )
    sea: SeaClutter | None = fields.part("sea clutter; default: none", default=None)
    land: tuple[Land, ...] = fields.part("ground", default=())
    chart: bool = fields.flag("the pictures' geometry brings a chart of the land", default=True)
    rain: tuple[Rain, ...] = fields.part("showers", default=())
    buoys: tuple[Buoy, ...] = fields.part("buoys", default=())
    racons: tuple[Racon, ...] = fields.part("radar beacons", default=())
    ownship: Ship = fields.part(
        "what carries the radar; default: it rests at the origin, its bow to the north",
        default=Factory(lambda: Ship(start=np.zeros(2), course=np.pi / 2)),
    )
    latitude: float = fields.quantity("deg", "of the origin", default=54.17, at_least=-89, at_most=89)
    longitude: float = fields.quantity("deg", "of the origin", default=12.1, at_least=-180, at_most=180)
    video: str = fields.choice(
        "what a frame is: the screen, or the sweeps behind it: power (sweeps, range cells) from the bow clockwise",
        ("screen", "sweeps"),
        default="screen",
    )
    interface: bool = fields.flag("draw rings, scale, heading line and texts over the echoes", default=True)
    title: str = fields.text("first line of the interface's text", default="VEDETTE SIM")
    reference: str = fields.choice(
        "what tracks are held against: hull centres, or AIS", ("truth", "ais", "none"), default="truth"
    )

    def __attrs_post_init__(self) -> None:
        if not self.vessels:
            raise ValueError("vessels: must hold at least one vessel, got none")
        if self.lost > max(self.frames - 2, 0):
            raise ValueError(f"lost: must leave the first and the last of {self.frames} pictures, got {self.lost}")
        if self.first is not None and self.first < self.radar.period:
            raise ValueError(f"first: must be >= the antenna's period, {self.radar.period:.6g} s, got {self.first:.6g} s")
        if self.last > _MOST_TURNS * min(self.radar.period, 1.0):
            text = f"must make a scene of at most {_MOST_TURNS:g} s and turns of the antenna, got {self.last:.6g} s"
            raise ValueError(f"interval: {text}")
        check_ownship(self.ownship)
        for name, vessel in self.vessels.items():
            if vessel.path.appears >= self.last:
                raise ValueError(f"vessels.{name}.path.appears: must be before the end at {self.last:.6g} s")
        if self.reference == "ais" and not any(vessel.ais for vessel in self.vessels.values()):
            raise ValueError("reference: 'ais' needs a vessel with `ais`")

    @property
    def last(self) -> float:
        """Return the time of the last picture in s."""
        return self._first + (self.frames - 1) * self.interval

    @property
    def _first(self) -> float:
        return self.radar.period if self.first is None else self.first

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return pictures for the one camera among the sensors, each made on demand, and the truth."""
        screens = [name for name, sensor in sensors.items() if isinstance(sensor, ImagingSensor)]
        if len(screens) != 1:
            given = ", ".join(sensors) or "none"
            raise ConfigError.at("sensors", f"radar pictures need one sensor that is a camera; got {given}")
        seed = int(rng.integers(2**63))
        made = self.painter(seed)
        times = self.times(seed)
        scans = LazyScans(len(times), lambda i: made.scan(float(times[i]), screens[0]))
        return Recording(scans, self.truth(times, seed))

    def times(self, seed: int) -> Array:
        """Return the pictures' times (s,) in s, without those of lost pictures."""
        inner = np.arange(1, self.frames - 1)
        gone = own_stream(seed, LOST).choice(inner, self.lost, replace=False) if self.lost else np.zeros(0, dtype=int)
        return self._first + np.setdiff1d(np.arange(self.frames), gone) * self.interval

    def world(self) -> World:
        """Return what the synthesis needs to know of the scene."""
        return World(
            self.radar, self.ownship, self.vessels, self.sea, self.land, self.rain, self.buoys, self.racons
        )  # fmt: skip

    def painter(self, seed: int) -> Painter:
        """Return the painter that makes the pictures; ConfigError that names the place if the scene cannot be drawn."""
        try:
            synthesis = Synthesis(self.world(), seed)
        except ValueError as error:
            raise ConfigError.at("radar", str(error)) from None
        try:
            synthesis.lay_land(self.last)
        except ValueError as error:
            raise ConfigError.at("land", str(error)) from None
        return Painter.of(self, synthesis)

    def truth(self, times: Array, seed: int) -> tuple[Trajectory, ...]:
        """Return hull centres at the pictures' times while each vessel is there, or its AIS, or nothing, by `reference`."""
        if self.reference == "ais":
            sent, origin = self.ais(seed), (self.latitude, self.longitude)
            return tuple(path for reports in sent.values() for path in trajectories(reports, origin, 200.0))
        return () if self.reference == "none" else self.centres(times)

    def centres(self, times: Array) -> tuple[Trajectory, ...]:
        """Return hull centres at the pictures' times while each vessel is there."""
        made = []
        for name, vessel in self.vessels.items():
            path = vessel.path
            edges = life(path.appears, path.disappears, times, self.last)
            body = np.broadcast_to([vessel.length, vessel.width], (len(edges), 2))
            heading = BODY.canonical(np.column_stack([path.states(edges), path.heading(edges), body]))
            made.append(Trajectory(name, BODY, edges, heading))
        return tuple(made)

    def ais(self, seed: int, run: int = 0) -> dict[str, Reports]:
        """Draw what each vessel with a transponder sent, by its name; each `run` is another draw."""
        origin = (self.latitude, self.longitude)
        paths = {}
        for number, (name, vessel) in enumerate(self.vessels.items()):
            if vessel.ais is not None:
                mmsi = vessel.ais.mmsi or 211_000_001 + number
                stream = own_stream(seed, AIS, run, *name.encode())
                paths[name] = reports(vessel.path, vessel.ais, mmsi, self.last + 10.0, origin, stream)
        return paths

    def antenna(self, name: str, times: Array) -> Array:
        """Return the true position of a vessel's AIS antenna: east and north (s, 2)."""
        vessel = self.vessels[name]
        offset = np.zeros(2) if vessel.ais is None else vessel.ais.antenna
        return antenna_path(vessel.path, offset, times)


@final
@frozen(eq=False)
class Painter:
    """Makes scans with pictures: echoes in colour under the interface."""

    scene: RadarPicturesScene
    synthesis: Synthesis
    geometry: PictureGeometry
    colours: NDArray[np.uint8]
    overlay: NDArray[np.uint8]
    known: Mapping[str, Any]

    @classmethod
    def of(cls, scene: RadarPicturesScene, synthesis: Synthesis) -> Painter:
        """Draw the interface once."""
        radar, size = scene.radar, scene.radar.size
        blank: tuple[NDArray[np.uint8], Array] = (np.zeros((size, size, 3), dtype=np.uint8), np.zeros((0, 4)))
        overlay, boxes = display.interface(radar, scene.title) if scene.interface else blank
        geometry = PictureGeometry(
            metres_per_pixel=radar.metres_per_pixel,
            centre=np.full(2, radar.centre),
            width=size,
            height=size,
            range=radar.range,
            stabilisation=radar.up,
            latitude=scene.latitude,
            longitude=scene.longitude,
            overlays=boxes,
            colours=display.COLOURS,
        )
        land = land_mask(scene.land, size, radar.metres_per_pixel) if scene.land and scene.chart else None
        known = geometry.as_json() | {"land": land}
        return cls(scene, synthesis, geometry, display.palette(), np.ascontiguousarray(np.moveaxis(overlay, 2, 0)), known)

    def pixels(self, time: float) -> NDArray[np.uint8]:
        """Return the screen at `time`: blue, green, red (3, h, w)."""
        picture = display.coloured(self.synthesis.picture(time), self.colours)
        if self.scene.interface:
            np.maximum(picture, self.overlay, out=picture)
            bow = float(self.synthesis.world.bow(np.array(time)))
            display.heading_line(picture, self.scene.radar, bow if self.scene.radar.up == "north-up" else 0.0)
        return picture

    def scan(self, time: float, sensor: str) -> Scan:
        """Return the picture at `time` as a scan with own ship's pose and the geometry, or the sweeps up to then."""
        if self.scene.video == "sweeps":
            frame = Frame(cast(Any, np.float32(10.0) ** (self.synthesis.sweeps(time)[0] / np.float32(10.0))))
        else:
            frame = Frame(cast(Any, self.pixels(time)), geometry=self.known)
        plain = Scan.image(time, sensor, frame)
        return Scan(plain.time, plain.sensor, plain.detections, self.scene.ownship.pose(time), plain.frame)
