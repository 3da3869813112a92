"""Messages to browsers and other clients of a WebSocket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from hmac import compare_digest
from queue import Empty, Full, Queue
from threading import Event, Lock, Thread
from typing import Any, ClassVar, final

from attrs import define, field, frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Output
from vedette_files.libraries import needed
from vedette_live.addresses import PATIENCE, Security, host_field, port_field

HELD = 64
"""Reports that wait for one client; the oldest are dropped."""


@final
@frozen
class WebSocketOutput(Output):
    """Each report is a message to all who are connected. By websockets. RFC 6455, The WebSocket Protocol, 2011.

    A page of another origin than those named is refused; with a token, clients send it as `Authorization: Bearer TOKEN`.
    """

    kind: ClassVar[str] = "websocket"

    port: int = port_field()
    host: str = host_field("of this machine where connections come")
    origins: tuple[str, ...] = fields.words("of pages that may connect; programs that are no page always may", default=())
    most: int = fields.integer("connections at once", default=32, at_least=1, at_most=1000)
    security: Security = fields.part("TLS and a token", default=Security())

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        server = needed("websockets.sync.server", "WebSockets need websockets", "live")
        clients, token = _Clients(self.most), self.security.token

        def allowed(connection: Any, request: Any) -> Any:
            given = request.headers.get("Authorization", "").encode()
            if token is not None and not compare_digest(given, b"Bearer " + token):
                return connection.respond(401, "the token is needed\n")
            return None

        try:
            served = server.serve(
                clients.serve, self.host, self.port, origins=[None, *self.origins], max_size=2**12,
                ssl=self.security.server(), process_request=allowed,
            )  # fmt: skip
        except ValueError as error:
            raise InputError(f"websocket {self.host}:{self.port}: {error}") from None
        thread = Thread(target=served.serve_forever, daemon=True)
        thread.start()
        try:
            yield clients.send
        finally:
            clients.stop.set()
            served.shutdown()
            thread.join()


@final
@define
class _Clients:
    """Those who are connected: each takes from a queue of its own."""

    most: int
    stop: Event = field(factory=Event)
    lock: Lock = field(factory=Lock)
    queues: list[Queue[bytes]] = field(factory=list)

    def serve(self, connection: Any) -> None:
        """Send one client what comes, until it goes."""
        waiting = Queue[bytes](HELD)
        with self.lock:
            if len(self.queues) >= self.most:
                connection.close(1013, "too many connections")
                return
            self.queues.append(waiting)
        try:
            while not self.stop.is_set():
                try:
                    data = waiting.get(timeout=PATIENCE)
                except Empty:
                    connection.ping()
                    continue
                try:
                    connection.send(data.decode())
                except UnicodeDecodeError:
                    connection.send(data)
        except Exception:  # it went away: no error of the service
            return
        finally:
            with self.lock:
                self.queues.remove(waiting)

    def send(self, data: bytes) -> None:
        """Give a report to all."""
        with self.lock:
            there = list(self.queues)
        for client in there:
            try:
                client.put_nowait(data)
            except Full:
                with suppress(Empty, Full):  # the oldest makes room
                    client.get_nowait()
                    client.put_nowait(data)
