"""The page of a run that goes on, and what happens in it, for browsers on this machine alone."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from hmac import compare_digest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from secrets import token_urlsafe
from threading import BoundedSemaphore, Event, Thread
from time import monotonic
from typing import Any, final

from vedette.types import Frame
from vedette_report.watching.journal import Journal

READERS = 8
"""At most so many pages at once."""

_LOOPBACK = "127.0.0.1"
_PATIENCE = 10.0
"""s that a request may take to be said."""
_BEAT = 5.0
"""s without a scan after which a reader is told nothing, to see whether it is there."""
Picture = Callable[[Frame], dict[str, Any]]


@final
class Server:
    """Serves a page and a journal at `address`, whose path nobody can guess, until it is closed.

    It listens on the loopback interface only. It answers requests for its own host and of its own origin, and none else:
    another site's script can neither ask for the page nor find its path by a name of its own for this machine.
    """

    def __init__(self, page: str, journal: Journal, picture: Picture, port: int = 0) -> None:
        self.journal, self.page, self.picture = journal, page.encode(), picture
        self.token, self.places = token_urlsafe(16), BoundedSemaphore(READERS)
        self.greeted, self.closing = Event(), Event()
        handler = type("_Answers", (_Handler,), {"own": self})
        self._http = _Http((_LOOPBACK, port), handler)
        self.port = int(self._http.server_address[1])
        self.hosts = (f"{_LOOPBACK}:{self.port}", f"localhost:{self.port}")
        self.address = f"http://{self.hosts[0]}/{self.token}/"
        self._thread = Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    def close(self, wait: float) -> None:
        """Let the readers take what is left, for at most `wait` s, and stop."""
        end = monotonic() + wait
        for _ in range(READERS):
            self.places.acquire(timeout=max(0.0, end - monotonic()))
        self.closing.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(_PATIENCE)


@final
class _Http(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a browser that goes away is no error of the run."""


class _Handler(BaseHTTPRequestHandler):
    """Answers one request; `own` is the server that it belongs to."""

    own: Server
    timeout = _PATIENCE
    server_version, sys_version = "vedette", ""

    def do_GET(self) -> None:
        """Answer with the page, or with the events."""
        found = self._refusal()
        if found is not None:
            self.send_error(found[0], found[1])
        elif self.path.endswith("/events"):
            self._serve_events()
        else:
            self._head("text/html; charset=utf-8")
            self.wfile.write(self.own.page)

    def _refusal(self) -> tuple[int, str] | None:
        """Return why a request is refused, with the code for it; None if it is not."""
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or hosts[0] not in self.own.hosts:
            return 421, "Ask this machine by its own name"
        if any(origin != f"http://{hosts[0]}" for origin in self.headers.get_all("Origin", [])):
            return 403, "No other origin"
        if self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            return 403, "No other site"
        given = self.path.encode()
        if not any(compare_digest(given, f"/{self.own.token}/{name}".encode()) for name in ("", "events")):
            return 404, "Nothing here"
        return None

    def _head(self, kind: str) -> None:
        self.send_response(200)
        for name, value in (
            ("Content-Type", kind),
            ("Cache-Control", "no-store"),
            ("Content-Security-Policy", "frame-ancestors 'none'"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            ("X-Frame-Options", "DENY"),
            ("Connection", "close"),
        ):
            self.send_header(name, value)
        self.end_headers()

    def _serve_events(self) -> None:
        if not self.own.places.acquire(blocking=False):
            self.send_error(503, f"At most {READERS} pages at once")
            return
        try:
            self._head("text/event-stream")
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

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Say nothing: what a browser asks for is nobody's business."""
