"""Whether a sender began again: by messages in a row that are behind, and come as those of a clock that was set back do."""

from __future__ import annotations

from collections import deque
from typing import final

from attrs import define, evolve, field

from vedette.streams import Arrival, Message

Held = deque[tuple[Message, Arrival]]

BACK = 60.0
"""s behind the latest time from which a clock may have been set back: what is less cures itself within a minute."""
COUNT = 10
"""Messages of a row, at least: by hand."""
LASTS = 5.0
"""s of it by our clock, at least: by hand; what is sent again mostly takes less."""
ALIKE = 1.5
"""Two times between messages are alike if neither is so many times as long: by hand."""
HELD = 1000
"""Messages, the latest of a row whose numbers came before, that are taken if their sender counts anew."""


@final
@define
class Row:
    """Messages in a row that are behind: the time of the `first` one and when it came, and how many they are.

    Those of a clock that was set back come as far apart as their times are. Those that make up for a pause come faster, and
    those of a clock that stands still slower.
    """

    first: tuple[float, float] | None = None
    count: int = 0

    def add(self, time: float, came: float) -> bool:
        """Take the next one; return whether the row is of a clock that was set back. One that is long enough begins anew."""
        first, arrived = self.first = self.first or (time, came)
        self.count += 1
        apart, passed = time - first, came - arrived
        if self.count < COUNT or passed < LASTS:
            return False
        self.first, self.count = None, 0
        return passed / ALIKE <= apart <= ALIKE * passed


@final
@define
class Again:
    """Rows of messages whose numbers came before, by input and sensor."""

    _rows: dict[tuple[int, str], tuple[Row, Held]] = field(factory=dict)

    def forget(self, key: tuple[int, str]) -> None:
        """End a row: a number rose."""
        self._rows.pop(key, None)

    def add(self, key: tuple[int, str], message: Message, arrival: Arrival, *, kept: bool) -> Held | None:
        """Take the next one, `kept` if it is to be taken should its sender count anew; if it does, return all that are."""
        if message.time is None:
            return None
        row, held = self._rows.setdefault(key, (Row(), Held(maxlen=HELD)))
        if kept:
            held.append((message, evolve(arrival, data=b"")))
        if row.add(message.time, arrival.time):
            del self._rows[key]
            return held
        if not row.count:
            held.clear()
        return None
