"""A server for browsers on this machine alone: who is answered, and with which headers."""

from __future__ import annotations

from hmac import compare_digest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from secrets import token_urlsafe
from threading import Thread
from typing import Any, ClassVar, final

from vedette.errors import InputError

LOOPBACK = "127.0.0.1"
PATIENCE = 10.0
"""s that a request may take to be said."""


@final
class LocalServer:
    """Answers by `handler` on the loopback interface, at `address`, whose path nobody can guess, until it is closed."""

    def __init__(self, handler: type[LocalHandler], owner: Any, port: int = 0) -> None:
        self.token = token_urlsafe(16)
        try:
            self._http = _Http((LOOPBACK, port), type("_Answers", (handler,), {"own": owner, "door": self}))
        except OSError as error:
            raise InputError(f"the page: port {port} cannot be listened to: {error.strerror or error}") from None
        self.port = int(self._http.server_address[1])
        self.hosts = (f"{LOOPBACK}:{self.port}", f"localhost:{self.port}")
        self.address = f"http://{self.hosts[0]}/{self.token}/"
        self._thread = Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop."""
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(PATIENCE)


@final
class _Http(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a browser that goes away is no error of the run."""


class LocalHandler(BaseHTTPRequestHandler):
    """Answers one request for its own host and of its own origin, and none else: `own` is who it belongs to.

    Another site's script can neither ask for a page nor find its path by a name of its own for this machine.
    """

    own: Any
    door: LocalServer
    names: ClassVar[tuple[str, ...]] = ("",)
    """What may be asked for, below the path."""

    timeout = PATIENCE
    server_version, sys_version = "vedette", ""

    def refuses(self) -> bool:
        """Return whether the request is refused; it is then answered."""
        refusal = self._refusal()
        if refusal is not None:
            self.send_error(refusal[0], refusal[1])
        return refusal is not None

    def _refusal(self) -> tuple[int, str] | None:
        """Return why a request is refused, with the code for it; None if it is not."""
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or hosts[0] not in self.door.hosts:
            return 421, "Ask this machine by its own name"
        if any(origin != f"http://{hosts[0]}" for origin in self.headers.get_all("Origin", [])):
            return 403, "No other origin"
        if self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            return 403, "No other site"
        given = self.path.encode()
        if not any(compare_digest(given, f"/{self.door.token}/{name}".encode()) for name in self.names):
            return 404, "Nothing here"
        return None

    def head(self, kind: str) -> None:
        """Begin an answer of this media type."""
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

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Say nothing: what a browser asks for is nobody's business."""
