"""Lines out of the pieces of a stream."""

from __future__ import annotations

from collections.abc import Callable

from attrs import frozen

from vedette.streams import Decoded, Message

LONGEST = 2**20
"""Bytes of a line; a scan of 10,000 returns takes a third of it."""


@frozen
class Rest:
    """What is left of a stream after its last line end: at most LONGEST bytes; `skipping` the rest of a line beyond it."""

    data: bytes = b""
    skipping: bool = False


def split(rest: Rest, data: bytes) -> tuple[Rest, list[bytes], int]:
    """Return what is left, the lines that are complete, without their ends, and the number of those beyond LONGEST."""
    *lines, last = (rest.data + data).split(b"\n")
    too_long = 0
    if rest.skipping:
        if not lines:
            return Rest(b"", True), [], 0
        lines = lines[1:]
    kept = [line for line in lines if len(line) <= LONGEST]
    too_long += len(lines) - len(kept)
    if len(last) > LONGEST:
        return Rest(b"", True), kept, too_long + 1
    return Rest(last), kept, too_long


def decoded(rest: Rest, data: bytes, read: Callable[[bytes], Message | None]) -> Decoded:
    """Return the messages of the lines that are complete; `read` gives a line's, None for one that is passed over."""
    rest, lines, too_long = split(rest, data)
    messages, refused = [], [f"a line is longer than {LONGEST:,} bytes"] * too_long
    for line in lines:
        try:
            if (message := read(line)) is not None:
                messages.append(message)
        except ValueError as error:
            refused.append(str(error))
    return Decoded(rest, messages, refused)


def ended(rest: Rest, read: Callable[[bytes], Message | None]) -> Decoded:
    """Return the message of a last line without its end, if there is one."""
    left = decoded(rest, b"\n", read) if rest.data else Decoded(Rest())
    return Decoded(Rest(), left.messages, left.refused)
