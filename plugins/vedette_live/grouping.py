"""Messages become scans: each alone, or those of a turn of the antenna, of a sector, of an interval."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from hashlib import blake2b
from math import floor, inf
from typing import final

import numpy as np
from attrs import define, field, frozen

from vedette import fields
from vedette.space import Array, Indices
from vedette.streams import Message
from vedette.types import Detections, Scan
from vedette_live.placing import Placing, missing
from vedette_live.setback import ALIKE, BACK, Row

WAYS = ("message", "turn", "sector", "interval")
CLOCKS = ("sensor", "receiver", "offset")
MOST = 50_000
"""Messages of a scan, at most: by a clock that stands still it would never be complete."""
COPIES = 10_000
"""Latest messages of which copies are recognised: those of 10 s of a thousand plots a second."""
CAME = "came already, with the same returns"
UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}
"""In which times may be told by mistake, and how many there are in a second."""
NEAR = 0.1
"""Share by which a time since 1970 in another unit may differ from ours: six years."""
FAST = 5
"""Messages in a row, each alone, whose times are so far apart as they came in ms, of which the health tells: by hand."""
ALONE = 0.01
"""s after the one before from which a message came alone: what was stored comes faster, at any ratio to its times."""
STILL = 60.0
"""s in which a clock has told one time after which the health tells: some tell whole minutes."""


@frozen(eq=False)
class Formed:
    """A scan, when its last message came, the number of messages that it holds, and what acknowledges them.

    `acknowledge`: (stream, sensor in the stream, number) of the numbered ones; `copies`: what copies of them have in common.
    """

    scan: Scan
    arrived: float
    messages: int
    acknowledge: tuple[tuple[str, str, int], ...] = ()
    copies: tuple[str, ...] = ()


@final
@frozen
class Grouping:
    """How the messages of an input become scans, and by whose clock.

    A scan's time is that of its last return. Where a message tells the time of each return, each is taken at it; the others
    at those of their messages, unless `own_times` is false.
    """

    by: str = fields.choice("what belongs to one scan", WAYS, default="message")
    length: float = fields.quantity("s", "of an interval; longest duration of a turn or a sector", default=10.0, above=0)
    wait: float = fields.quantity("s", "silence after which a scan of several messages is complete", default=1.0, above=0)
    clock: str = fields.choice(
        "that tells time: the sensor's, the receiver's, the sensor's with its least delay", CLOCKS, default="sensor"
    )
    leap: float = fields.quantity(
        "s", "by which a time may be ahead of the last one; a longer leap is believed once the next message agrees",
        default=600.0, above=0,
    )  # fmt: skip
    own_times: bool = fields.flag("take each return at the time of its message, not at the scan's", default=True)


@final
@define
class Clock:
    """The time of messages of one sensor: unwrapped, and moved by the least delay between sensor and receiver.

    One wrong time far ahead would make all that follow too late: it is refused, unless the next one agrees. Of a sensor that
    sends more seldom than that, the time between two messages is learnt. `latest` is the latest time since it was set back,
    `behind`: messages that are late by more than a minute. `heard`: the time of the last one, and when it came; `fast`: how
    many in a row are as if in ms; `unit`: why the last one is surely not in s, or "".
    """

    by: str
    leap: float = inf
    offset: float = inf
    last: float | None = None
    doubted: float | None = None
    since: float | None = None
    latest: float | None = None
    behind: Row = field(factory=Row)
    heard: tuple[float, float] | None = None
    fast: int = 0
    unit: str = ""

    def ailment(self, now: float) -> str:
        """Return what the health tells of it; "" if it goes as ours."""
        if self.unit or self.fast >= FAST:
            return self.unit or "its times pass 1000 times as fast as ours: they must be in s, and seem to be in ms"
        stood = 0.0 if self.since is None else now - self.since
        return f"it stands still at {self.last:.6f} s, for {stood:.0f} s" if stood > STILL else ""

    def stated(self, time: float | None, period: float | None) -> float | None:
        """Return the time that the last message told, unwrapped; None if it told none, or none that is unwrapped."""
        if time is None or self.by != "receiver":
            return None if time is None else self.last
        return time if period is None else None

    def time(self, stated: float | None, period: float | None, arrived: float | None) -> float:
        """Return the time of a message in s; ValueError if it tells none and nobody knows when it came."""
        if arrived is None and stated is None:
            raise ValueError("time: is missing, and the record does not tell when the message came")
        if stated is None or (self.by == "receiver" and arrived is not None):
            assert arrived is not None
            heard = arrived if self.since is None else self.since
            if self.by == "sensor" and self.last is not None and abs(heard - self.last) > self.leap:
                raise ValueError(f"time: is missing, and the last of this sensor, {self.last:.6f} s, is not of our clock")
            return arrived
        near = self.last if arrived is None else arrived
        if period is not None and near is not None:  # the day, or the turn of a short counter, nearest to when it came
            stated += period * floor((near - stated) / period + 0.5)
        if arrived is not None and period is None:
            self._check_unit(stated, arrived)
        self._check(stated)
        if stated != self.last or self.since is None:
            self.since = arrived
        self.last = stated
        self.latest = stated if self.latest is None else max(stated, self.latest)
        if self.latest - stated <= BACK and (arrived is None or arrived - stated - self.offset <= BACK):
            self.behind = Row()
        elif arrived is not None and self.behind.add(stated, arrived):
            self.latest, self.offset = stated, inf
        if self.by == "offset" and arrived is not None:
            self.offset = min(self.offset, arrived - stated)
            stated += self.offset
        return stated

    def _check_unit(self, stated: float, arrived: float) -> None:
        """Raise ValueError for a time that is ours but for its unit; count those that are as far apart as ours in ms."""
        alike = [unit for unit, factor in UNITS.items() if abs(stated - arrived * factor) < NEAR * arrived * factor]
        self.unit = f"time: {stated:.0f} is now in {alike[0]} since 1970: it must be in s" if alike and arrived > 1e9 else ""
        if self.unit:
            raise ValueError(self.unit)
        if self.heard is not None and (passed := arrived - self.heard[1]) >= ALONE:
            alone = 1 / ALIKE < (stated - self.heard[0]) / passed / UNITS["ms"] < ALIKE
            self.fast = self.fast + 1 if alone else 0
        self.heard = stated, arrived

    def _check(self, stated: float) -> None:
        """Raise ValueError for a time that leaps, unless it is the second one to say so."""
        if self.latest is not None and stated - self.latest > self.leap:
            apart = inf if self.doubted is None else abs(stated - self.doubted)
            if self.doubted is None or not 0 < apart <= max(self.leap, ALIKE * (self.doubted - self.latest)):  # 0: a copy
                self.doubted = stated
                told = f"{stated - self.latest:.6g} s after the last one, more than scans.leap, {self.leap:g} s"
                raise ValueError(f"time: {stated:.6f} s is {told}: it is believed once the next message agrees")
            self.leap = max(self.leap, ALIKE * apart)
        self.doubted = None


@frozen(eq=False)
class _Piece:
    """A message, its returns over the sensor's axes, its time, the stream it came by, and what a copy has in common."""

    message: Message
    z: Array
    time: float
    stream: str
    copy: str


@define(eq=False)
class _Open:
    """A scan that is not complete."""

    sensor: str
    first: float
    arrived: float
    slot: float
    pieces: list[_Piece] = field(factory=list)


@final
@define
class Grouper:
    """Forms the scans of one input: `add` takes a message, `due` gives what silence, or the end, completes.

    A copy of a message, as a second path of a network brings it, is refused: in a scan of several it would be a second
    target, and after it a scan of its own. Where each message is a scan, whoever takes scans refuses it, by any input.
    """

    grouping: Grouping
    placing: Placing
    clocks: dict[str, Clock] = field(factory=dict)
    opened: dict[str, _Open] = field(factory=dict)
    came: OrderedDict[str, None] = field(factory=OrderedDict)

    def add(self, message: Message, arrived: float | None, stream: str = "") -> Iterator[Formed]:
        """Yield the scans that a message completes; ValueError, and no change, if it cannot be used."""
        if message.refused:
            raise ValueError(message.refused)
        name = self.placing.sensor(message.sensor)
        z = self.placing.returns(message, name)
        _check_times(message, self.grouping.length)
        clock = self.clocks.setdefault(message.sensor, Clock(self.grouping.clock, self.grouping.leap))
        time = clock.time(message.time, message.period, arrived)
        came = time if arrived is None else arrived
        alone = self.grouping.by == "message"
        copy = _copy(message, name, z, time if alone else clock.stated(message.time, message.period))
        piece = _Piece(message, z, time, stream, copy)
        if alone:
            if not message.marker:
                yield self._formed(name, [piece], came)
            return
        if copy in self.came:
            raise ValueError(CAME)
        if copy:
            self.came[copy] = None
        if len(self.came) > COPIES:
            self.came.popitem(last=False)
        now_open = self.opened.get(name)
        slot = floor(time / self.grouping.length) if self.grouping.by == "interval" else 0.0
        boundary = message.marker == "north" or (message.marker == "sector" and self.grouping.by == "sector")
        too_long = now_open is not None and (
            abs(time - now_open.first) >= self.grouping.length or len(now_open.pieces) >= MOST
        )
        if now_open is not None and (boundary or too_long or slot > now_open.slot):
            yield self._close(name, time if boundary and not now_open.pieces else None)
        if name not in self.opened and (boundary or not message.marker):
            self.opened[name] = _Open(name, time, came, slot)
        if not message.marker:
            self.opened[name].pieces.append(piece)
            self.opened[name].arrived = came

    def due(self, now: float = inf) -> Iterator[Formed]:
        """Yield the scans to which nothing has come for a while; at the end of the input, what has come of all."""
        for name, one in list(self.opened.items()):
            if one.pieces and now - one.arrived >= self.grouping.wait:
                yield self._close(name, None)

    def _close(self, name: str, time: float | None) -> Formed:
        """Return the complete scan of a sensor; one without returns, between two marks, has the `time` of the last."""
        one = self.opened.pop(name)
        if one.pieces:
            return self._formed(name, one.pieces, one.arrived)
        nothing = Detections.of([], len(self.placing.sensors[name].measurement))
        scan = Scan(one.first if time is None else time, name, nothing, self.placing.pose(name))
        return Formed(scan, one.arrived, 0)

    def _formed(self, name: str, pieces: list[_Piece], arrived: float) -> Formed:
        messages = [piece.message for piece in pieces]
        z = np.concatenate([piece.z for piece in pieces])
        detections = Detections(
            z,
            np.ones(len(z), dtype=bool),
            _joined([message.evidence for message in messages]),
            _joined([message.noise for message in messages]),
            missing(z, self.placing.sensors[name]),
            identity=_identities(messages),
            time=_times(pieces, own=self.grouping.own_times),
        )
        pose = next((message.pose for message in reversed(messages) if message.pose is not None), self.placing.pose(name))
        numbered = tuple(
            (piece.stream, of.sensor, of.number) for piece in pieces if (of := piece.message).number is not None
        )
        last = max(piece.time for piece in pieces)
        if detections.time is not None:
            last = float(np.max(detections.time, initial=last))
        scan = Scan(last, name, detections, pose)
        return Formed(scan, arrived, len(messages), numbered, tuple(piece.copy for piece in pieces if piece.copy))


def _copy(message: Message, name: str, z: Array, time: float | None) -> str:
    """Return what copies of a message have in common: its sensor, time and values. "" of one without a time, or empty."""
    if time is None or not (len(z) or message.marker):
        return ""
    held = blake2b(f"{name} {time} {message.marker} {message.angle}".encode(), digest_size=8)
    for part in (z, message.times, message.evidence, message.noise, message.identity):
        held.update(b"" if part is None else np.ascontiguousarray(part).tobytes())
    return held.hexdigest()


def _check_times(message: Message, length: float) -> None:
    """Raise ValueError for times of returns that no scan of the message can have."""
    if message.times is None or not len(message.times):
        return
    if message.time is None:
        raise ValueError("times: must come with the scan's time")
    if (late := float(np.max(message.times)) - message.time) > length:
        raise ValueError(f"times: one is {late:.6g} s after the scan's, more than scans.length, {length:g} s")


def _times(pieces: list[_Piece], *, own: bool) -> Array | None:
    """Return when each return was measured, by the clock of the messages; None if that is when the scan was.

    own: whether the time of a message is that of its returns where it tells no other.
    """
    known = [piece.message.times is not None and piece.message.time is not None for piece in pieces]
    if not any(known) and not (own and len({piece.time for piece in pieces}) > 1):
        return None
    times = [
        piece.message.times + (piece.time - piece.message.time) if told else np.full(len(piece.z), piece.time)  # type: ignore[operator]
        for piece, told in zip(pieces, known, strict=True)
    ]
    return np.concatenate(times)


def _identities(messages: list[Message]) -> Indices | None:
    """Return whom the returns name, -1 where a message does not tell; None if none does."""
    if all(message.identity is None for message in messages):
        return None
    return np.concatenate([
        np.full(len(message.z), -1) if message.identity is None else message.identity for message in messages
    ])  # fmt: skip


def _joined(parts: list[Array | None]) -> Array | None:
    """Return what all messages tell; None unless all do."""
    given = [part for part in parts if part is not None]
    return np.concatenate(given) if len(given) == len(parts) else None
