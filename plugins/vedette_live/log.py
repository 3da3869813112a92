"""The log of a service, which does not fill up with what one input brings."""

from __future__ import annotations

import logging
from typing import final

import numpy as np
from attrs import define, field

from vedette.streams import now

LOG = logging.getLogger("vedette.live")
CLOSED = "connection closed"
_QUIET = 10.0
"""s between two lines of the log that say the same of one input."""


@final
@define
class Sparing:
    """Warns of what one input brings, each kind at most once in a while, with how often it came since."""

    name: str
    _since: dict[str, tuple[float, int]] = field(factory=dict)

    def warn(self, event: str, told: str, stream: str) -> None:
        """Warn, unless the same was said just now."""
        at, count = self._since.get(event, (-np.inf, 0))
        if now() - at < _QUIET:
            self._since[event] = at, count + 1
            return
        self._since[event] = now(), 0
        LOG.warning(event, extra={"from": f"{self.name} {stream}"[:100], "why": told[:300], "more": count})
