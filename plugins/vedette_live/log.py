"""The log of a service, which does not fill up with what one input brings."""

from __future__ import annotations

import logging
import re
from threading import Lock
from typing import final

from attrs import define, field

from vedette.streams import now

LOG = logging.getLogger("vedette.live")
CLOSED = "connection closed"
KINDS = 20
"""Kinds of reasons for one event that get lines of their own; all others share one."""
_QUIET = 10.0
"""s between two lines of the log that say the same of one input."""
_GIVEN = re.compile(r" got .*|'[^']*'|\"[^\"]*\"|[-+]?\d[\w.+-]*", re.DOTALL)
"""What two reasons of one kind may differ in."""


@define
class _Said:
    """When a kind was told last, what came of it last, and how often it came untold since."""

    at: float
    told: str
    stream: str
    untold: int = 0


@final
@define
class Sparing:
    """Warns of what one input brings, each kind of reason at once, then at most once in a while.

    A line stands for one message, and for as many `more`.
    """

    name: str
    _said: dict[tuple[str, str], _Said] = field(factory=dict)
    _lock: Lock = field(factory=Lock)

    def warn(self, event: str, told: str, stream: str) -> None:
        """Warn, unless the like was said just now."""
        kind = event, _GIVEN.sub("", told)
        with self._lock:
            if kind not in self._said and sum(of == event for of, _ in self._said) >= KINDS:
                kind = event, ""
            said, at = self._said.get(kind), now()
            if said is not None and at - said.at < _QUIET:
                said.told, said.stream, said.untold = told, stream, said.untold + 1
                return
            self._said[kind] = _Said(at, told, stream)
        self._line(event, told, stream, 0 if said is None else said.untold)

    def tell(self, *, last: bool = False) -> None:
        """Tell what came untold, once it is time to, or this is the `last` occasion."""
        with self._lock:
            over = {kind: said for kind, said in self._said.items() if last or now() - said.at >= _QUIET}
            for kind, said in over.items():
                if said.untold:
                    self._said[kind] = _Said(now(), said.told, said.stream)
                else:
                    del self._said[kind]
        for (event, _), said in over.items():
            if said.untold:
                self._line(event, said.told, said.stream, said.untold - 1)

    def _line(self, event: str, told: str, stream: str, more: int) -> None:
        source = f"{self.name} {stream}".strip()[:100]
        LOG.warning(event, extra={"from": source, "why": told[:300], "more": more})
