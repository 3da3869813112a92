"""What waits between two threads, within bounds."""

from __future__ import annotations

from collections import deque
from threading import Condition
from typing import Generic, TypeVar, final

from attrs import define, field

T = TypeVar("T")


@final
@define
class BoundedQueue(Generic[T]):
    """At most `most` items. What is put into a full one waits for room, or pushes out the oldest that did not wait."""

    most: int
    items: deque[tuple[T, bool]] = field(factory=deque)
    closed: bool = False
    _changed: Condition = field(factory=Condition)

    def put(self, item: T, *, wait: bool) -> list[T]:
        """Add an item; return what was pushed out. One that waits when the queue is closed is returned itself."""
        with self._changed:
            while wait and len(self.items) >= self.most and not self.closed:
                self._changed.wait()
            if self.closed:
                return [item]
            self.items.append((item, wait))
            self._changed.notify_all()
            if len(self.items) <= self.most:
                return []
            oldest = next(i for i, (_, waited) in enumerate(self.items) if not waited)
            pushed_out, _ = self.items[oldest]
            del self.items[oldest]
            return [pushed_out]

    def take(self, most: int, timeout: float) -> list[T]:
        """Return up to `most` items in order, as soon as there is one; none after `timeout` s."""
        with self._changed:
            if not self.items and not self.closed:
                self._changed.wait(timeout)
            taken = [self.items.popleft()[0] for _ in range(min(most, len(self.items)))]
            self._changed.notify_all()
            return taken

    def close(self) -> None:
        """Let nobody wait any more; what is in it can still be taken."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()
