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

    Inputs add what comes, in their threads; the thread that tracks says what is taken and kept. `replies`: of the
    connections whose messages have numbers.
    """

    kept: dict[str, int] = field(factory=dict)
    replies: dict[str, Callable[[bytes], None]] = field(factory=dict)
    _seen: dict[str, int] = field(factory=dict)
    _waiting: deque[tuple[Number, int, str]] = field(factory=deque)
    _taken: dict[tuple[str, str], int] = field(factory=dict)

    def last(self, number: Number) -> int:
        """Return the highest number that has come of a message's input and sensor; -1 if none has."""
        key = _key(*number[:2])
        return max(self._seen.get(key, -1), self.kept.get(key, -1))

    def came(self, number: Number) -> bool:
        """Return whether a message has come before; whoever sent it again is answered once it is kept."""
        if number[2] > self.last(number):
            return False
        self._waiting.append((number, number[2], ""))
        return True

    def refuse(self, number: Number, why: str) -> None:
        """Answer, once all before it is kept, that a message cannot be used; its number is -1 where nobody knows it."""
        self._waiting.append((number, min(number[2], self.last(number)), why))

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
        """Answer with the latest number of each connection, now that all up to these are kept, and with what is refused."""
        self.kept, done, self._taken = dict(numbers), self._taken, {}
        refused = list[tuple[Number, str]]()
        for _ in range(len(self._waiting)):
            untaken, needed, why = self._waiting.popleft()
            if needed > self.kept.get(_key(*untaken[:2]), -1):  # it waits for others to be taken, or to be kept
                self._waiting.append((untaken, needed, why))
            elif why:
                refused.append((untaken, why))
            else:
                _raise(done, [untaken])
        told = {number for number, _ in refused}
        kept = [((*key, count), "") for key, count in done.items() if (*key, count) not in told]
        for number, why in sorted([*refused, *kept]):
            self.reply(number, why)

    def reply(self, number: Number, refused: str = "") -> None:
        """Answer one message, if its connection is still there."""
        stream, sensor, count = number
        answer = {"ack": count, "sensor": sensor, "refused": refused}
        try:
            if reply := self.replies.get(stream):
                reply(json.dumps({name: told for name, told in answer.items() if told not in ("", -1)}).encode() + b"\n")
        except OSError:
            self.replies.pop(stream, None)


def _key(stream: str, sensor: str) -> str:
    """Return the input and the sensor of a stream, which begins with the number of its input."""
    return f"{stream.partition(' ')[0]} {sensor}"


def _raise(highest: dict[tuple[str, str], int], numbers: Iterable[Number]) -> None:
    """Keep the highest number of each stream and sensor."""
    for stream, sensor, number in numbers:
        highest[stream, sensor] = max(number, highest.get((stream, sensor), -1))
