"""Numbered messages: what came before is recognised, and what is kept is answered."""

from __future__ import annotations

import json
from bisect import bisect_right, insort
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import final

from attrs import define, field

MISSED = 300
"""Runs of numbers that were left out, the latest of each input and sensor, which may still come late."""
FEW = 10
"""Lines of a stream that could not be read, the latest, which are answered if a later one has a number."""
Number = tuple[str, str, int]
"""The stream by which a message came, its sensor there, and its number."""
Run = tuple[int, int]
"""The first and the last of numbers that follow each other."""


@final
@define(eq=False)
class Acknowledging:
    """The numbers of messages, which rise by input and sensor: those that have come, been taken and been kept.

    A number that was left out may come late. `missed`: of each input and sensor the first and last of each run of these,
    in order; `_late`: those that came since, and are not taken yet. `begins`: what is added to the numbers of each input and
    sensor that counted anew, so that they rise.

    Inputs add what comes, in their threads; the thread that tracks says what is taken and kept. `replies`: of the
    connections whose messages have numbers.
    """

    kept: dict[str, int] = field(factory=dict)
    replies: dict[str, Callable[[bytes], None]] = field(factory=dict)
    missed: dict[str, list[Run]] = field(factory=dict)
    begins: dict[str, int] = field(factory=dict)
    _late: set[tuple[str, int]] = field(factory=set)
    _seen: dict[str, int] = field(factory=dict)
    _waiting: deque[tuple[Number, int, str]] = field(factory=deque)
    _taken: dict[tuple[str, str], int] = field(factory=dict)
    _marks: deque[tuple[Number, int]] = field(factory=deque)
    _unreadable: dict[str, deque[str]] = field(factory=dict)
    _ended: dict[str, dict[str, int]] = field(factory=dict)

    def begin(self, stream: str, reply: Callable[[bytes], None]) -> None:
        """Answer a stream from now on, as a message of it has a number; and what could not be read before."""
        self.replies[stream] = reply
        for why in self._unreadable.pop(stream, ()):
            self.refuse((stream, "", -1), why)

    def refuse_line(self, stream: str, why: str) -> None:
        """Answer that a line cannot be read, once its stream is known to have numbers."""
        if stream in self.replies:
            self.refuse((stream, "", -1), why)
        else:
            self._unreadable.setdefault(stream, deque(maxlen=FEW)).append(why)

    def end(self, stream: str, reply: Callable[[bytes], None] | None) -> None:
        """Answer a stream no more, once all that came by its input is kept; at once if nothing can be answered."""
        self._unreadable.pop(stream, None)
        if reply is None:
            self.replies.pop(stream, None)
        elif stream in self.replies:
            begin, seen = _key(stream, ""), self._seen.copy()  # other inputs add to it meanwhile
            self._ended[stream] = {key: number for key, number in seen.items() if key.startswith(begin)}
        else:
            reply(b"")

    def raised(self, stream: str, sensor: str) -> int:
        """Return what is added to the numbers of a sensor."""
        return self.begins.get(_key(stream, sensor), 0)

    def count_anew(self, stream: str, sensor: str) -> None:
        """Take the numbers of a sensor, from now on, as those after all that came."""
        self.begins[_key(stream, sensor)] = self.last((stream, sensor, 0)) + 1

    def last(self, number: Number) -> int:
        """Return the highest number that has come of a message's input and sensor; -1 if none has."""
        key = _key(*number[:2])
        return max(self._seen.get(key, -1), self.kept.get(key, -1))

    def lasts(self, name: int) -> dict[str, int]:
        """Return the highest number that has come of each sensor of an input."""
        begin = _key(str(name), "")
        keys = {key for known in (self._seen.copy(), self.kept) for key in known if key.startswith(begin)}
        return {sensor: self.last((str(name), sensor, 0)) for sensor in (key.removeprefix(begin) for key in keys)}

    def came(self, number: Number) -> bool:
        """Return whether a message has come before; whoever sent it again is answered once it is kept."""
        if number[2] > self.last(number) or self._missed(number) is not None:
            return False
        self._waiting.append((number, number[2], ""))
        return True

    def refuse(self, number: Number, why: str) -> None:
        """Answer, once all before it is kept, that a message cannot be used; its number is -1 where nobody knows it."""
        self._waiting.append((number, min(number[2], self.last(number)), why))

    def note(self, number: Number) -> None:
        """Remember that a message has come: of a sensor that is known, as others may have very many names."""
        key, count, last, at = _key(*number[:2]), number[2], self.last(number), self._missed(number)
        missed = self.missed.setdefault(key, [])
        if at is not None:
            self._late.add((key, count))
            first, end = missed[at]
            missed[at : at + 1] = [one for one in ((first, count - 1), (count + 1, end)) if one[0] <= one[1]]
        elif count > last + 1:
            missed.append((last + 1, count - 1))
        del missed[:-MISSED]
        self._seen[key] = max(count, last)

    def _missed(self, number: Number) -> int | None:
        """Return the place of the run of numbers left out that a number is of."""
        return _place(self.missed.get(_key(*number[:2]), []), number[2])

    def untaken(self, taken: Mapping[str, int]) -> dict[str, list[Run]]:
        """Return the runs of numbers below those `taken` of each input and sensor that are not: they may still come."""
        runs = {key: list(missed) for key, missed in self.missed.copy().items()}
        for key, count in self._late.copy():  # read second: what moves from one to the other meanwhile is in both
            if _place(known := runs.setdefault(key, []), count) is None:
                insort(known, (count, count))
        return {
            key: [(first, min(last, taken[key])) for first, last in known if first <= taken[key]]
            for key, known in runs.items()
            if key in taken
        }

    def first_untaken(self, name: int, taken: Mapping[str, int]) -> dict[str, int]:
        """Return the first number of each sensor of an input that is not taken."""
        begin, runs = _key(str(name), ""), self.untaken(taken)
        return {
            key.removeprefix(begin): runs[key][0][0] if runs.get(key) else last + 1
            for key, last in taken.items()
            if key.startswith(begin)
        }

    def mark(self, number: Number) -> None:
        """Remember that a message has come that is in no scan: it is taken once what came before it is."""
        self._marks.append((number, self.last(number)))

    def take(self, numbers: Collection[Number]) -> None:
        """Remember that messages are taken, or refused."""
        _raise(self._taken, numbers)
        self.drop(numbers)

    def drop(self, numbers: Iterable[Number]) -> None:
        """Wait no more for messages that came late."""
        self._late.difference_update((_key(*number[:2]), number[2]) for number in numbers)

    def taken(self) -> dict[str, int]:
        """Return the latest number of each input and sensor that is taken."""
        numbers = dict(self.kept)
        for (stream, sensor), number in self._taken.items():
            key = _key(stream, sensor)
            numbers[key] = max(number, numbers.get(key, -1))
        for _ in range(len(self._marks)):
            mark, before = self._marks.popleft()
            if before > numbers.get(key := _key(*mark[:2]), -1):
                self._marks.append((mark, before))
            else:
                self.take([mark])
                numbers[key] = max(mark[2], numbers.get(key, -1))
        return numbers

    def keep(self, numbers: Mapping[str, int]) -> None:
        """Answer with the latest number of each connection, now that all up to these are kept, and with what is refused."""
        self.kept, done, self._taken, ended = dict(numbers), self._taken, {}, list(self._ended.items())
        refused = list[tuple[Number, str]]()
        for _ in range(len(self._waiting)):
            untaken, needed, why = self._waiting.popleft()
            key = _key(*untaken[:2])
            if needed > self.kept.get(key, -1) or (key, needed) in self._late:  # until others are taken, or kept
                self._waiting.append((untaken, needed, why))
            elif why:
                refused.append((untaken, why))
            else:
                _raise(done, [untaken])
        told = {number for number, _ in refused}
        kept = [((*key, count), "") for key, count in done.items() if (*key, count) not in told]
        for number, why in sorted([*refused, *kept]):
            self.reply(number, why)
        for stream, last in ended:
            if all(self.kept.get(key, -1) >= number for key, number in last.items()):
                self._ended.pop(stream)
                self._send(stream, b"")
                self.replies.pop(stream, None)

    def reply(self, number: Number, refused: str = "") -> None:
        """Answer one message, if its connection is still there."""
        stream, sensor, count = number
        told = max(count - self.raised(stream, sensor), -1)
        answer = {"ack": told, "sensor": sensor, "refused": refused}
        given = {name: value for name, value in answer.items() if value not in ("", -1)}
        if refused or told >= 0:  # not of one that came before its sender counted anew
            self._send(stream, json.dumps(given).encode() + b"\n")

    def _send(self, stream: str, data: bytes) -> None:
        try:
            if reply := self.replies.get(stream):
                reply(data)
        except OSError:
            self.replies.pop(stream, None)


def _key(stream: str, sensor: str) -> str:
    """Return the input and the sensor of a stream, which begins with the number of its input."""
    return f"{stream.partition(' ')[0]} {sensor}"


def _place(runs: list[Run], number: int) -> int | None:
    """Return the place of the run that holds a number."""
    at = bisect_right(runs, number, key=lambda run: run[0]) - 1
    return at if at >= 0 and number <= runs[at][1] else None


def _raise(highest: dict[tuple[str, str], int], numbers: Iterable[Number]) -> None:
    """Keep the highest number of each stream and sensor."""
    for stream, sensor, number in numbers:
        highest[stream, sensor] = max(number, highest.get((stream, sensor), -1))
