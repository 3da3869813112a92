"""The page of a run that goes on, and what happens in it, for browsers on this machine alone."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from threading import BoundedSemaphore, Event
from time import monotonic
from typing import Any, ClassVar, final

from vedette.types import Frame
from vedette_report.watching.journal import Journal
from vedette_report.watching.local import LocalHandler, LocalServer

READERS = 8
"""At most so many pages at once."""

_BEAT = 5.0
"""s without a scan after which a reader is told nothing, to see whether it is there."""
Picture = Callable[[Frame], dict[str, Any]]


@final
class Server:
    """Serves a page and a journal at `address`, on this machine alone, until it is closed."""

    def __init__(self, page: str, journal: Journal, picture: Picture, port: int = 0) -> None:
        self.journal, self.page, self.picture = journal, page.encode(), picture
        self.places, self.greeted, self.closing = BoundedSemaphore(READERS), Event(), Event()
        self._local = LocalServer(_Handler, self, port)
        self.address = self._local.address

    def close(self, wait: float) -> None:
        """Let the readers take what is left, for at most `wait` s, and stop."""
        end = monotonic() + wait
        for _ in range(READERS):
            self.places.acquire(timeout=max(0.0, end - monotonic()))
        self.closing.set()
        self._local.close()


class _Handler(LocalHandler):
    """Answers one request; `own` is the server that it belongs to."""

    own: Server
    names: ClassVar[tuple[str, ...]] = ("", "events")

    def do_GET(self) -> None:
        """Answer with the page, or with the events."""
        if self.refuses():
            return
        if self.path.endswith("/events"):
            self._serve_events()
        else:
            self.head("text/html; charset=utf-8")
            self.wfile.write(self.own.page)

    def _serve_events(self) -> None:
        if not self.own.places.acquire(blocking=False):
            self.send_error(503, f"At most {READERS} pages at once")
            return
        try:
            self.head("text/event-stream")
            self.own.greeted.set()
            self.connection.settimeout(None)  # a slow reader is waited for: nobody else is held up by it
            self._follow(self._begin())
        except (OSError, ValueError):
            return  # it went away
        finally:
            self.own.places.release()

    def _begin(self) -> int:
        """Return the scan from which a reader wants to go on: that after the last one that it got."""
        given = self.headers.get("Last-Event-ID", "")
        return min(int(given), self.own.journal.count) if given.isdecimal() and len(given) < 16 else 0

    def _follow(self, number: int) -> None:
        """Tell a reader all that happens from a scan on."""
        journal, shown = self.own.journal, -1
        while not self.own.closing.is_set():
            taken = journal.after(number, _BEAT)
            parts = []
            if taken.lost:
                parts.append(f"event: lost\ndata: {taken.lost}\n\n".encode())
            if taken.picture is not None and shown < taken.picture[0] < taken.next:
                shown = taken.picture[0]
                text = json.dumps({"scan": shown, **self.own.picture(taken.picture[1])})
                parts.append(f"event: picture\ndata: {text}\n\n".encode())
            if taken.text:
                parts += [b"id: %d\ndata: " % taken.next, taken.text, b"\n\n"]
            if taken.ended is not None:
                parts.append(f"event: ended\ndata: {taken.ended}\n\n".encode())
            self.wfile.write(b"".join(parts) or b":\n\n")
            number = taken.next
            if taken.ended is not None:
                self.connection.shutdown(socket.SHUT_WR)
                return
