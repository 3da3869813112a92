"""Datagrams, and connections that we make or that come to us."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, Queue
from threading import Event, Lock, Thread
from typing import Any, ClassVar, final

from attrs import define, field, frozen

from vedette import fields
from vedette.streams import Output
from vedette_live.addresses import NO_ROOM, PATIENCE, REST, Security, host_field, port_field
from vedette_live.inputs.mqtt import connected, fits
from vedette_live.log import CLOSED, Sparing

LARGEST = 1400
"""Bytes of a datagram at most, where a report has several lines: what passes most networks whole."""


@final
@frozen
class UdpOutput(Output):
    """Datagrams to a host or a multicast group; what is longer than one holds is parted at line ends, where it has any.

    RFC 768, User Datagram Protocol, 1980.
    """

    kind: ClassVar[str] = "udp"

    port: int = port_field()
    host: str = host_field("to which datagrams go")
    hops: int = fields.integer("networks that a multicast may cross", default=1, at_least=0, at_most=255)

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as here:
            if family == socket.AF_INET:
                here.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, self.hops)

            def send(data: bytes) -> None:
                for piece in pieces(data):
                    here.sendto(piece, (self.host, self.port))

            yield send


def pieces(data: bytes) -> list[bytes]:
    """Return what goes into one datagram each: all of it if it fits, else as many whole lines as fit."""
    if len(data) <= LARGEST or data.count(b"\n") < 2:
        return [data]
    lines, now = list[bytes](), b""
    for line in data.splitlines(keepends=True):
        if now and len(now) + len(line) > LARGEST:
            lines.append(now)
            now = b""
        now += line
    return [*lines, now] if now else lines


@final
@frozen
class TcpClientOutput(Output):
    """A connection to a server; while there is none, what is sent fails, is counted, and a new one is tried."""

    kind: ClassVar[str] = "tcp_client"

    port: int = port_field()
    host: str = host_field("of the server")
    tls: bool = fields.flag("whether the connection is encrypted", default=False)
    security: Security = fields.part("whom to trust, and the token that is sent", default=Security())

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        context, token = self.security.client() if self.tls else None, self.security.token
        here = socket.create_connection((self.host, self.port), timeout=5.0)
        try:
            if context is not None:
                here = context.wrap_socket(here, server_hostname=self.host)
            if token is not None:
                here.sendall(token + b"\n")
            yield here.sendall
        finally:
            here.close()


@final
@frozen
class TcpServerOutput(Output):
    """Whoever connects gets what is sent from then on; a reader that takes nothing for 2 s loses its connection.

    One more than `most` is closed; the log tells of both.
    """

    kind: ClassVar[str] = "tcp_server"

    port: int = port_field()
    host: str = host_field("of this machine where connections come")
    most: int = fields.integer("connections at once", default=64, at_least=1, at_most=10_000)
    security: Security = fields.part("TLS and a token", default=Security())

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        readers = _Readers(self.most, self.security, self.security.server(), Sparing(f"tcp {self.port}"))
        with socket.create_server((self.host, self.port), family=family, backlog=64) as server:
            server.settimeout(PATIENCE)
            thread = Thread(target=readers.accept, args=(server,), daemon=True)
            thread.start()
            try:
                yield readers.send
            finally:
                readers.stop.set()
                thread.join()
                readers.close()


@final
@define
class _Readers:
    """Those who are connected."""

    most: int
    security: Security
    context: ssl.SSLContext | None
    log: Sparing
    stop: Event = field(factory=Event)
    lock: Lock = field(factory=Lock)
    connected: list[socket.socket] = field(factory=list)

    def accept(self, server: socket.socket) -> None:
        """Take connections until it is to stop; each says its token in a thread of its own, at most 5 s long."""
        while not self.stop.is_set():
            try:
                here, _ = server.accept()
            except TimeoutError:
                continue
            except OSError as error:
                self.log.warn(NO_ROOM, str(error), "")
                self.stop.wait(REST)
                continue
            here.settimeout(2.0)
            if self.context is None and not self.security.token_file:
                self._add(here)
            else:
                Thread(target=self._greet, args=(here,), daemon=True).start()

    def _greet(self, here: socket.socket) -> None:
        try:
            if self.context is not None:
                here = self.context.wrap_socket(here, server_side=True)
            if self.security.token_file:
                with here.makefile("rb") as lines:
                    if not self.security.allows(lines.readline(4200)):
                        here.close()
                        return
            self._add(here)
        except (OSError, ValueError):
            here.close()

    def _add(self, here: socket.socket) -> None:
        with self.lock:
            if len(self.connected) >= self.most:
                self.log.warn(CLOSED, f"it is one more than `most` of the output, {self.most}", "")
                here.close()
            else:
                self.connected.append(here)

    def send(self, data: bytes) -> None:
        """Send to all; who does not take it is dropped."""
        with self.lock:
            there = list(self.connected)
        for here in there:
            try:
                here.sendall(data)
            except (OSError, ValueError) as error:
                self.log.warn(CLOSED, f"its reader: {error}", "")
                with self.lock:
                    self.connected.remove(here)
                here.close()

    def close(self) -> None:
        """Close all."""
        for here in self.connected:
            here.close()


@final
@frozen
class MqttOutput(Output):
    """Messages of a topic, each a report. By paho-mqtt. OASIS, MQTT Version 5.0, 2019."""

    kind: ClassVar[str] = "mqtt"

    topic: str = fields.text("of the messages")
    port: int = port_field()
    host: str = host_field("of the broker")
    tls: bool = fields.flag("whether the connection is encrypted", default=False)
    user: str = fields.text("name of the user; the password is the token", default="")
    security: Security = fields.part("whom to trust, and the password", default=Security())

    def __attrs_post_init__(self) -> None:
        if not fits(self.topic) or {"+", "#"} & set(self.topic):
            raise ValueError(f"topic: must be a name without + and #, got {self.topic!r}")

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        answers = Queue[str]()
        with connected(self, lambda client, why_not: answers.put(why_not)) as client:
            client.loop_start()
            try:
                # what is sent before there is a connection would be lost, and this one closed
                why_not = answers.get(timeout=5.0)
            except Empty:
                why_not = "no answer"
            if why_not:
                raise OSError(f"mqtt {self.host}:{self.port}: not connected: {why_not}")

            def send(data: bytes) -> None:
                told: Any = client.publish(self.topic, data)
                if told.rc:
                    raise OSError(f"mqtt {self.host}:{self.port}: not connected")

            yield send
