"""Whether a sender began again: by messages in a row that are behind, and come as those of a clock that was set back do."""

from __future__ import annotations

from typing import final

from attrs import define

BACK = 60.0
"""s behind the latest time from which a clock may have been set back: what is less cures itself within a minute."""
COUNT = 10
"""Messages of a row, at least: by hand."""
LASTS = 5.0
"""s of it by our clock, at least: by hand; what is sent again mostly takes less."""
ALIKE = 1.5
"""Two times between messages are alike if neither is so many times as long: by hand."""


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
