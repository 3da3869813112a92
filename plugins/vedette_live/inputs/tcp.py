"""Connections: of clients that come to us, or to a server that we go to."""

from __future__ import annotations

import select
import selectors
import socket
import ssl
from collections.abc import Iterator
from contextlib import suppress
from threading import Event, Lock
from time import monotonic, sleep
from typing import ClassVar, final

from attrs import define, field, frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Arrival, Input, now
from vedette_live.addresses import NO_ROOM, PATIENCE, REST, Security, host_field, port_field
from vedette_live.log import CLOSED, Sparing

PIECE = 2**16
"""Bytes that are read at once."""
FIRST_LINE = 4200
"""Bytes in which a client must have said its token."""


@final
@frozen
class TcpServerInput(Input):
    """Connections that come to a port, each a stream of its own; what acknowledges a message goes back by its connection.

    A connection that is silent for `idle`, one more than `most`, or one without the token is closed, and the log says so.
    RFC 9293, Transmission Control Protocol, 2022.
    """

    kind: ClassVar[str] = "tcp_server"

    port: int = port_field()
    host: str = host_field("of this machine where connections come")
    most: int = fields.integer("connections at once", default=64, at_least=1, at_most=10_000)
    idle: float = fields.quantity("s", "silence after which a connection is closed", default=3600.0, above=0)
    security: Security = fields.part("TLS and a token", default=Security())

    def listen(self, stop: Event) -> Iterator[Arrival]:
        context, wants = self.security.server(), self.security.token is not None
        log = Sparing(f"tcp {self.port}")
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            server = socket.create_server((self.host, self.port), family=family, backlog=self.most)
        except OSError as error:
            raise InputError(f"tcp {self.host}:{self.port}: cannot be listened to: {error.strerror or error}") from None
        with server, selectors.DefaultSelector() as chosen:
            server.setblocking(False)
            chosen.register(server, selectors.EVENT_READ)
            connections, looked = dict[socket.socket, _Connection](), monotonic()
            try:
                while not stop.is_set():
                    for key, _ in chosen.select(PATIENCE):
                        if key.fileobj is server:
                            self._accept(server, chosen, connections, context, wants, log)
                        else:
                            yield from self._read(connections[key.fileobj], chosen, connections, log)  # type: ignore[index]
                    if (at := monotonic()) - looked > PATIENCE:
                        looked = at
                        for each in list(connections.values()):
                            if each.shut:
                                yield _closed(each, chosen, connections)
                            elif at - each.heard > self.idle:
                                log.warn(CLOSED, f"nothing came for {self.idle:g} s", each.name)
                                yield _closed(each, chosen, connections)
            finally:
                for connection in connections.values():
                    connection.close()

    def _accept(
        self,
        server: socket.socket,
        chosen: selectors.BaseSelector,
        connections: dict[socket.socket, _Connection],
        context: ssl.SSLContext | None,
        wants: bool,
        log: Sparing,
    ) -> None:
        try:
            here, sender = server.accept()
        except BlockingIOError:  # it went away
            return
        except OSError as error:
            log.warn(NO_ROOM, str(error), "")
            sleep(REST)
            return
        if len(connections) >= self.most and (done := next((each for each in connections.values() if each.ended), None)):
            done.close()
            del connections[done.here]
        if len(connections) >= self.most:
            log.warn(CLOSED, f"it is one more than `most` of the input, {self.most}", f"{sender[0]}:{sender[1]}")
            here.close()
            return
        here.setblocking(False)
        if context is not None:
            here = context.wrap_socket(here, server_side=True, do_handshake_on_connect=False)
        connections[here] = _Connection(here, f"{sender[0]}:{sender[1]}", not wants)
        chosen.register(here, selectors.EVENT_READ)

    def _read(
        self, one: _Connection, chosen: selectors.BaseSelector, connections: dict[socket.socket, _Connection], log: Sparing
    ) -> Iterator[Arrival]:
        while data := one.receive():
            one.heard = monotonic()
            if not one.allowed:
                one.first += data
                line, end, rest = one.first.partition(b"\n")
                if not end and len(line) <= FIRST_LINE:
                    continue
                if not end or not self.security.allows(line):
                    log.warn(CLOSED, "its first line is not the token", one.name)
                    break
                one.allowed, data = True, rest
            yield Arrival(data, now(), one.name, one.send)
            if not isinstance(one.here, ssl.SSLSocket):
                return  # the others have their turn; what TLS has decoded already would not wake us
        if data == b"" and one.allowed and not one.shut:  # it may wait for answers
            chosen.unregister(one.here)
            one.ended = True
            yield Arrival(b"", now(), one.name, one.send, ended=True)
            if not one.shut:
                return
        if data is not None:
            yield _closed(one, chosen, connections)


@final
@define(eq=False)
class _Connection:
    """One connection; others may send by it, so a lock is held while they do, and shut it; who reads closes it."""

    here: socket.socket
    name: str
    allowed: bool
    heard: float = field(factory=monotonic)
    first: bytes = b""
    ended: bool = False
    shut: bool = False
    lock: Lock = field(factory=Lock)

    def receive(self) -> bytes | None:
        """Return what has come, b"" at the end; None if nothing has. One that fails is shut: it takes no answers."""
        try:
            with self.lock:
                return self.here.recv(PIECE)
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return None
        except (OSError, ValueError):
            self.end()
            return b""

    def send(self, data: bytes) -> None:
        """Send, or shut it for b""; a reader that takes nothing for a second loses it, not the service its time."""
        if not data:
            self.end()
        end = monotonic() + 1.0
        try:
            while data:
                with self.lock:
                    try:
                        data = data[self.here.send(data) :]
                        continue
                    except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
                        pass
                if monotonic() > end or not select.select([], [self.here], [], end - monotonic())[1]:
                    raise TimeoutError
        except (OSError, ValueError):
            self.end()

    def end(self) -> None:
        """Shut it, so that who reads wakes up; an error is none."""
        self.shut = True
        with suppress(OSError):
            self.here.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close it."""
        self.end()
        self.here.close()


def _closed(one: _Connection, chosen: selectors.BaseSelector, connections: dict[socket.socket, _Connection]) -> Arrival:
    with suppress(KeyError):  # of one that has ended
        chosen.unregister(one.here)
    del connections[one.here]
    one.close()
    return Arrival(b"", now(), one.name, ended=True)


@final
@frozen
class TcpClientInput(Input):
    """A connection to a server that sends; when it is lost it is made again, after a pause that doubles up to `pause`."""

    kind: ClassVar[str] = "tcp_client"

    port: int = port_field()
    host: str = host_field("of the server")
    pause: float = fields.quantity("s", "longest pause before a connection is tried again", default=30.0, above=0)
    tls: bool = fields.flag("whether the connection is encrypted", default=False)
    security: Security = fields.part("whom to trust, and the token that is sent", default=Security())

    def listen(self, stop: Event) -> Iterator[Arrival]:
        context, token = self.security.client() if self.tls else None, self.security.token
        count, wait, server = 0, PATIENCE, f"{self.host}:{self.port}"
        while not stop.is_set():
            try:
                plain = socket.create_connection((self.host, self.port), timeout=5.0)
                with context.wrap_socket(plain, server_hostname=self.host) if context else plain as here:
                    if token is not None:
                        here.sendall(token + b"\n")
                    count, wait = count + 1, PATIENCE
                    yield Arrival(b"", now(), server)
                    yield from self._received(here, f"{server} #{count}", stop)
            except (OSError, ValueError) as error:
                yield Arrival(b"", now(), server, unwell=f"not connected: {error}")
            stop.wait(wait)
            wait = min(2 * wait, self.pause)

    def _received(self, here: socket.socket, name: str, stop: Event) -> Iterator[Arrival]:
        """Yield what comes; then a server that sends no more may wait for answers, for `pause` at most."""
        here.setblocking(False)
        one = _Connection(here, name, True)
        while not stop.is_set() and (data := one.receive()) != b"":
            if data is None:
                select.select([here], [], [], PATIENCE)
            else:
                yield Arrival(data, now(), name, one.send)
        yield Arrival(b"", now(), name, None if one.shut else one.send, ended=True)
        end = monotonic() + self.pause
        while not (one.shut or stop.wait(PATIENCE)) and monotonic() < end:
            pass
