"""The health of a service over HTTP, and what systemd wants to know."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any, final

from vedette.errors import InputError
from vedette_live.addresses import LOOPBACK


@final
class Health:
    """Answers on this machine alone: /metrics in Prometheus' text format, /health with 200 if all is well, else 503."""

    def __init__(self, port: int, metrics: Callable[[], str], ails: Callable[[], str]) -> None:
        handler = type("_Answers", (_Handler,), {"metrics": staticmethod(metrics), "ails": staticmethod(ails)})
        try:
            self._http = _Http((LOOPBACK, port), handler)
        except OSError as error:
            raise InputError(f"service.port: {port} cannot be listened to: {error.strerror or error}") from None
        self.port = int(self._http.server_address[1])
        Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()

    def close(self) -> None:
        """Stop."""
        self._http.shutdown()
        self._http.server_close()


@final
class _Http(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of who went away: the log is lines of JSON."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    metrics: Callable[[], str]
    ails: Callable[[], str]
    timeout = 5.0
    server_version, sys_version = "vedette", ""

    def do_GET(self) -> None:
        """Answer with the metrics, or with how the service is."""
        host = self.headers.get("Host", "").rpartition(":")[0]
        if host not in (LOOPBACK, "localhost"):
            self.send_error(421, "Ask this machine by its own name")
        elif self.path == "/metrics":
            self._answer(200, self.metrics())
        elif self.path == "/health":
            ails = self.ails()
            self._answer(503 if ails else 200, f"{ails or 'well'}\n")
        else:
            self.send_error(404, "Only /metrics and /health are here")

    def _answer(self, code: int, text: str) -> None:
        data = text.encode()
        self.send_response(code)
        self.send_header("Content-Type", "text/plain; version=0.0.4; charset=utf-8")
        self.send_header("Content-Length", str(len(data)))
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Say nothing."""


def notify(state: str) -> None:
    """Tell systemd how the service is, as READY=1; nothing where it did not start us."""
    path = os.environ.get("NOTIFY_SOCKET", "")
    if not path:
        return
    address = "\0" + path[1:] if path.startswith("@") else path
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as here:
            here.connect(address)
            here.sendall(state.encode())
    except OSError:
        return
