"""Numbered messages: what came before is recognised, and what is kept is answered."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import final

from attrs import define, field

Number = tuple[str, str, int]
"""The stream by which a message came, its sensor there, and its number."""


@final
@define(eq=False)
class Acknowledging:
    """The numbers of messages, which rise by input and sensor: those that have come, been taken and been kept.

    Inputs add what comes, in their threads; the thread that tracks says what is taken and kept.
    """

    kept: dict[str, int] = field(factory=dict)
    replies: dict[str, Callable[[bytes], None]] = field(factory=dict)
    _seen: dict[str, int] = field(factory=dict)
    _waiting: deque[tuple[Number, int]] = field(factory=deque)
    _taken: dict[tuple[str, str], int] = field(factory=dict)

    @property
    def asked(self) -> bool:
        """Whether somebody waits for the answer to a message that was not taken: it had come, or was refused."""
        return bool(self._waiting)

    def last(self, number: Number) -> int:
        """Return the highest number that has come of a message's input and sensor; -1 if none has."""
        key = _key(*number[:2])
        return max(self._seen.get(key, -1), self.kept.get(key, -1))

    def came(self, number: Number) -> bool:
        """Return whether a message has come before; whoever sent it again is answered once it is kept."""
        if number[2] > self.last(number):
            return False
        self._waiting.append((number, number[2]))
        return True

    def refuse(self, number: Number) -> None:
        """Answer a message that cannot be used once all before it is kept."""
        self._waiting.append((number, self.last(number)))

    def note(self, number: Number) -> None:
        """Remember that a message has come: of a sensor that is known, as others may have very many names."""
        self._seen[_key(*number[:2])] = number[2]

    def take(self, numbers: Iterable[Number]) -> None:
        """Remember that messages are taken, or refused."""
        _raise(self._taken, numbers)

    def taken(self) -> dict[str, int]:
        """Return the latest number of each input and sensor that is taken."""
        numbers = dict(self.kept)
        for (stream, sensor), number in self._taken.items():
            key = _key(stream, sensor)
            numbers[key] = max(number, numbers.get(key, -1))
        return numbers

    def keep(self, numbers: Mapping[str, int]) -> None:
        """Answer, each connection once, with the latest of its numbers, now that all up to these are kept."""
        self.kept, done, self._taken = dict(numbers), self._taken, {}
        for _ in range(len(self._waiting)):
            untaken, needed = self._waiting.popleft()
            if needed <= self.kept.get(_key(*untaken[:2]), -1):
                _raise(done, [untaken])
            else:  # it waits for others to be taken, or to be kept
                self._waiting.append((untaken, needed))
        for (stream, sensor), number in done.items():
            self.reply((stream, sensor, number))

    def reply(self, number: Number) -> None:
        """Answer one message, if its connection is still there."""
        stream, sensor, count = number
        reply = self.replies.get(stream)
        if reply is not None:
            named = {"sensor": sensor} if sensor else {}
            try:
                reply(json.dumps({"ack": count, **named}).encode() + b"\n")
            except OSError:
                self.replies.pop(stream, None)


def _key(stream: str, sensor: str) -> str:
    """Return the input and the sensor of a stream, which begins with the number of its input."""
    return f"{stream.partition(' ')[0]} {sensor}"


def _raise(highest: dict[tuple[str, str], int], numbers: Iterable[Number]) -> None:
    """Keep the highest number of each stream and sensor."""
    for stream, sensor, number in numbers:
        highest[stream, sensor] = max(number, highest.get((stream, sensor), -1))
