"""Laws of formats: bytes of any kind become messages or refusals, wherever they are split."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import attrs
import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.space import Space
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette.testing.comparisons import Broken, demand
from vedette.testing.law import Law, Profile
from vedette.values import held

LARGEST_MEMORY = 2**22
"""Bytes that the memory of a format may hold, whatever comes."""


@frozen
class Bytes:
    """A sample with some bytes exchanged, bytes without meaning, and where a stream is split, as shares of its length."""

    damaged: bytes
    noise: bytes
    cuts: tuple[float, ...]


_CHANGES = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=8)
_SHARES = st.lists(st.floats(0, 1), max_size=6).map(sorted).map(tuple)


def drawn(draw: st.DrawFn, format_: Format, profile: Profile) -> Bytes:
    """What every law of a format is given."""
    return Bytes(_damaged(format_.sample(), draw(_CHANGES)), draw(st.binary(max_size=400)), draw(_SHARES))


def _damaged(sample: bytes, changes: Sequence[tuple[float, int]]) -> bytes:
    data = bytearray(sample)
    for share, value in changes:
        if data:
            data[min(int(share * len(data)), len(data) - 1)] = value
    return bytes(data)


def _through(format_: Format, pieces: Sequence[bytes]) -> tuple[list[Message], list[str]]:
    """All messages and refusals of a stream that comes in pieces, and then ends."""
    memory, messages, refused = format_.start(), list[Message](), list[str]()
    for piece in (*pieces, None):
        try:
            decoded = format_.end(memory) if piece is None else format_.decode(memory, piece)
        except Exception as error:
            what = "end" if piece is None else f"decode of {piece[:40]!r}"
            raise Broken(f"{what}: must raise nothing, raised {type(error).__name__}: {error}") from error
        demand(isinstance(decoded, Decoded), f"decode: must return Decoded, returned {type(decoded).__name__}")
        memory = decoded.memory
        messages += decoded.messages
        refused += decoded.refused
    return messages, refused


def _told(messages: Sequence[Message]) -> list[tuple[Any, ...]]:
    """What messages tell, to be compared."""
    names = [field.name for field in attrs.fields(Message) if field.name != "pose"]
    return [tuple(_plain(getattr(message, name)) for name in names) for message in messages]


def _plain(value: Any) -> Any:
    return repr(value.tolist()) if isinstance(value, np.ndarray) else value


def pure(format_: Format, drawn: Bytes) -> None:
    """The same bytes give the same messages again."""
    first, again = (_through(format_, [drawn.damaged]) for _ in range(2))
    demand(_told(first[0]) == _told(again[0]) and first[1] == again[1], "decode: gives other messages the second time")


def its_sample_is_read(format_: Format, drawn: Bytes) -> None:
    """Its own sample holds messages, and none that is refused."""
    messages, refused = _through(format_, [format_.sample()])
    demand(not refused, f"sample: must hold no message that is refused, and one is: {''.join(refused[:1])}")
    demand(messages, "sample: must hold at least one message, so that the laws have something to try")


def no_bytes_make_it_raise(format_: Format, drawn: Bytes) -> None:
    """Whatever the bytes: it raises nothing, its refusals are lines of text, its numbers have the shapes that they state."""
    for data in (drawn.damaged, drawn.noise, format_.sample() + drawn.noise):
        messages, refused = _through(format_, [data])
        for told in refused:
            demand(isinstance(told, str) and told and "\n" not in told, f"refused: must be lines of text, got {told!r}")
        for message in messages:
            k = len(message.z)
            demand(message.z.ndim == 2, f"z: must be (k, m), got shape {message.z.shape}")
            otherwise = f"axes: must name the columns of z {message.z.shape}, got {message.axes}"
            demand(message.axes is None or not k or len(message.axes) == message.z.shape[1], otherwise)
            for name in ("times", "evidence", "noise", "identity"):
                values = getattr(message, name)
                demand(values is None or len(values) == k, f"{name}: must have an entry for each of {k} returns")


def split_anywhere(format_: Format, drawn: Bytes) -> None:
    """Where a stream is split changes neither its messages nor how many are refused."""
    for data in (format_.sample(), drawn.damaged):
        edges = [0, *(int(share * len(data)) for share in drawn.cuts), len(data)]
        pieces = [data[i:j] for i, j in pairwise(edges)]
        whole, parts = _through(format_, [data]), _through(format_, pieces)
        demand(_told(parts[0]) == _told(whole[0]), f"decode: split at {edges[1:-1]}, {data[:60]!r} gives other messages")
        demand(len(parts[1]) == len(whole[1]), f"decode: split at {edges[1:-1]}, it refuses {parts[1]}, not {whole[1]}")


def its_memory_is_bounded(format_: Format, drawn: Bytes) -> None:
    """A stream that never completes a message is not kept for ever."""
    memory, piece = format_.start(), (drawn.noise.replace(b"\n", b"") or b"x") * 2**13
    for _ in range(-(-2 * LARGEST_MEMORY // len(piece))):
        memory = format_.decode(memory, piece).memory
        size = _size(memory)
        demand(size <= LARGEST_MEMORY, f"memory: must hold at most {LARGEST_MEMORY:,} bytes, holds {size:,}")


def _size(memory: Any) -> int:
    if isinstance(memory, bytes | str):
        return len(memory)
    return sum(map(_size, held(memory)))


def writes_as_declared(format_: Format, drawn: Bytes) -> None:
    """If it writes: a report becomes bytes, the same again; one without tracks does too."""
    report = TrackReport(
        number=3,
        time=4000.25,
        space=Space.of(x="m", vx="m/s", y="m", vy="m/s"),
        ids=np.array([1, 70001]),
        mean=np.array([[1.0, 2.0, 3.0, 4.0], [-5.0, 6.0, 7.0, -8.0]]),
        cov=np.tile(np.eye(4), (2, 1, 1)),
        existence=np.array([1.0, 0.5]),
        confirmed=np.array([True, False]),
        geodetic=lambda mean: (mean[:, 0], mean[:, 2], mean[:, 0]),
    )
    none = attrs.evolve(report, **{name: getattr(report, name)[:0] for name in _BY_TRACK})
    for given in (report, none):
        first, again = format_.encode(given), format_.encode(given)
        demand(isinstance(first, bytes) and first == again, "encode: must return bytes, the same again")
    demand(format_.encode(report), "encode: two tracks must be something to say")


_BY_TRACK = ("ids", "mean", "cov", "existence", "confirmed")

LAWS = (
    *(Law(law, needs="reads") for law in (pure, its_sample_is_read, split_anywhere)),
    Law(its_memory_is_bounded, needs="reads", effort="long"),
    *(Law(no_bytes_make_it_raise), Law(writes_as_declared, needs="writes")),
)
