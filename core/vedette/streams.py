"""The supporting roles of a live run: Input, Format, Output and Store; and the values that pass between them.

An input brings bytes, a format makes messages of them, the tracker takes the scans that messages form, an output sends what
a format makes of the tracks, and a store keeps states and tracks for a restart.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from threading import Event
from time import monotonic, time
from typing import Any, ClassVar, Protocol

from attrs import Factory, field, frozen

from vedette.roles import Component
from vedette.space import Array, Indices, Mask, Space
from vedette.types import Pose

_BEGAN = time() - monotonic()


def now() -> float:
    """Return the time in s since 1970, by a clock that does not jump when the wall clock of the machine is set."""
    return _BEGAN + monotonic()


@frozen(eq=False)
class Arrival:
    """Bytes that came: when, by `now`, and from which `stream`, such as one connection of several.

    `reply` sends bytes back to where they came from, b"" once there are no more; None where nothing can be sent. `lost`
    counts the pieces that the system dropped before this one since the last; None where it does not tell. `ended`: the
    stream ends with these bytes. `unwell`: why nothing can come now, such as a connection that is refused, until the next.
    `place`: plain data by which `Input.go_on` finds what comes after these bytes; None if it cannot.
    """

    data: bytes
    time: float
    stream: str = ""
    reply: Callable[[bytes], None] | None = None
    lost: int | None = None
    ended: bool = False
    unwell: str = ""
    place: Any = None


@frozen(eq=False)
class Message:
    """What one message tells: returns of one sensor, or where its antenna points.

    sensor   its name in the stream, "" if the format gives none
    time     s; None if the message tells none
    z        (k, m) over `axes`, the names of the columns in SI units; None: the sensor's, in its order; NaN is missing
    times    (k,) s, the time of each return where they differ; else None
    evidence, noise, identity: as those of `vedette.Detections`
    pose     of the platform, if the message tells it
    marker   "north" or "sector": the antenna passes there; else "". `angle`: where it points, rad clockwise from north
    period   s after which `time` starts anew, such as 86,400 of a time of day; None: it does not
    number   by which the sender wants it acknowledged, or None
    refused  why it cannot be used, where no more than its sensor and number can; else ""
    frame    where x and y point, as "x north, y east", if the message tells it; else ""
    """

    sensor: str
    time: float | None
    z: Array
    axes: tuple[str, ...] | None = None
    times: Array | None = None
    evidence: Array | None = None
    noise: Array | None = None
    identity: Indices | None = None
    pose: Pose | None = None
    marker: str = ""
    angle: float | None = None
    period: float | None = None
    number: int | None = None
    refused: str = ""
    frame: str = ""


@frozen(eq=False)
class Decoded:
    """What was made of some bytes: the memory, messages, and a sentence for each message that was refused."""

    memory: Any
    messages: Sequence[Message] = ()
    refused: Sequence[str] = ()


@frozen(eq=False)
class TrackReport:
    """Tracks at one `time` in s: ids (t,), mean (t, n) and cov (t, n, n) over `space`, existence and confirmed (t,).

    `number` counts the scans that led to it: a report that is sent again has the same one. `geodetic` gives latitude,
    longitude (*b) in deg and altitude in m of positions (*b, 2 or 3) in m; None where the config names no origin. `ground`
    names the axes that point east and north.
    """

    number: int
    time: float
    space: Space
    ids: Indices
    mean: Array
    cov: Array
    existence: Array
    confirmed: Mask
    geodetic: Callable[[Array], tuple[Array, Array, Array]] | None = None
    ground: tuple[str, str] = ("x", "y")


class Format(Component):
    """How messages stand in bytes. What it keeps between pieces, such as half a message, is its memory; one that equals that
    of the start holds nothing that what follows needs.

    Laws: `decode` raises nothing, whatever the bytes; where a stream is split changes nothing; each message is either
    returned or refused. A class that only writes leaves `decode` as it is, and `reads` False.
    """

    reads: ClassVar[bool] = True
    """Whether it decodes messages."""
    writes: ClassVar[bool] = False
    """Whether it encodes tracks."""

    def sample(self) -> bytes:
        """Return some messages as they stand in bytes, one of each sort: what the laws try. Without them they try little."""
        return b""

    def start(self) -> Any:
        """Return the memory before the first byte."""
        return b""

    @abstractmethod
    def decode(self, memory: Any, data: bytes) -> Decoded:
        """Return the messages that are complete with this piece of a stream."""

    def end(self, memory: Any) -> Decoded:
        """Return what is left when the stream, or a datagram, ends: by default nothing may be left."""
        return Decoded(self.start(), (), ("ends within a message",) if memory else ())

    def encode(self, report: TrackReport) -> bytes:
        """Return the bytes of a report of tracks, b"" if there is nothing to say."""
        raise NotImplementedError(f"{type(self).__name__} does not write")


class Input(Component):
    """Where bytes come from while a service runs: a socket, a file that grows, a broker.

    Laws: `listen` ends within a second of `stop`; a failure that may pass, such as a lost connection, is tried again.
    """

    datagrams: ClassVar[bool] = False
    """Whether each piece holds whole messages; otherwise pieces of one stream follow on one another."""

    @abstractmethod
    def listen(self, stop: Event) -> Iterator[Arrival]:
        """Yield what comes until `stop` is set; InputError if nothing ever can. It runs in a thread of its own."""

    def go_on(self, stop: Event, place: Any) -> Iterator[Arrival]:
        """Yield what comes after a `place`, as `listen` does; after an empty Arrival that is `ended`, if that is lost."""
        return self.listen(stop)


class Output(Component):
    """Where bytes go. `send` may wait: it runs in a thread of its own, and reports that it is too slow for are dropped."""

    @abstractmethod
    def open(self) -> AbstractContextManager[Callable[[bytes], None]]:
        """Return what sends bytes, while it is open; OSError if they cannot be sent now."""


@frozen(eq=False)
class Saved:
    """What a service needs to go on: plain data of its states, and what it had counted.

    `notes`: what x, y and times mean, as a recording's. `older`: something saved later is damaged.
    """

    states: Any
    counters: Mapping[str, int] = Factory(dict)
    acknowledged: Mapping[str, int] = field(factory=dict)
    notes: Mapping[str, str] = field(factory=dict)
    older: bool = False


class Storage(Protocol):
    """A store that is open."""

    def load(self) -> Saved | None:
        """Return what was saved last and is whole; None if there is nothing."""

    def save(self, saved: Saved, reports: Sequence[TrackReport]) -> str | None:
        """Keep the state and the reports since the last time, all or nothing; return what ails the store all the same."""

    def close(self) -> None:
        """Release what it holds."""


class Store(Component):
    """Where states and tracks are kept for a restart. Law: what `save` was given is either kept whole or not at all."""

    @abstractmethod
    def open(self) -> Storage:
        """Return the store, ready; InputError if it cannot be used."""
