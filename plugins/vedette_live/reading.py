"""How far an input is read that can go on from a place, as a file: a restart takes each of its messages once."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, final

from attrs import define, field

from vedette_live.acknowledging import Acknowledging


@final
@define(eq=False)
class Reading:
    """Numbers the messages of an input by their sensor, once it is `placed`, in the stead of their sender's numbers.

    So what is read again after a restart is recognised. `counts`: how many have come of each sensor; `kept`: the latest
    place before which all are taken, and their counts there; `_marks`: later ones, between two messages.
    """

    name: int
    numbers: Acknowledging
    placed: bool = False
    counts: dict[str, int] = field(factory=dict)
    kept: tuple[Any, dict[str, int]] | None = None
    _marks: deque[tuple[Any, dict[str, int]]] = field(factory=deque)

    def begin(self, *, anew: bool = False) -> None:
        """Count on from the place that was kept; `anew`, or if there is none, from all that came."""
        if self.kept is not None and not anew:
            self.counts = dict(self.kept[1])
        else:
            self.counts = {sensor: last + 1 for sensor, last in self.numbers.lasts(self.name).items()}

    def next_number(self, sensor: str) -> int:
        """Count a message of a sensor; return its number."""
        self.counts[sensor] = self.counts.get(sensor, 0) + 1
        return self.counts[sensor] - 1

    def mark(self, place: Any) -> None:
        """Remember a place between two messages."""
        self._marks.append((place, dict(self.counts)))

    def taken(self, numbers: Mapping[str, int]) -> tuple[Any, dict[str, int]] | None:
        """Return the latest place before which all is taken, by the latest `numbers` that are."""
        untaken = self.numbers.first_untaken(self.name, numbers)
        while self._marks and all(count <= untaken.get(sensor, 0) for sensor, count in self._marks[0][1].items()):
            self.kept = self._marks.popleft()
        return self.kept
