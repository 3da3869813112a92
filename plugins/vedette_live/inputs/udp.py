"""Datagrams, to one or to many."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from ipaddress import ip_address
from threading import Event
from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Arrival, Input, now
from vedette_live.addresses import PATIENCE, host_field, port_field

LARGEST = 65_535
"""Bytes of a datagram."""
SO_RXQ_OVFL = 40
"""Asks Linux to tell with each datagram how many were dropped so far; Python has no name for it."""


@final
@frozen
class UdpInput(Input):
    """Datagrams that come to a port; a `host` that is a multicast group is joined at `interface`.

    On Linux the system tells how many datagrams it dropped for want of room.
    RFC 768, User Datagram Protocol, 1980; RFC 1112, Host Extensions for IP Multicasting, 1989.
    """

    kind: ClassVar[str] = "udp"
    datagrams: ClassVar[bool] = True

    port: int = port_field()
    host: str = host_field("of this machine where datagrams come, or a multicast group")
    interface: str = host_field("of this machine that joins the multicast group")
    room: int = fields.integer("bytes that the system is asked to hold for us", default=2**22, at_least=2**12)

    def listen(self, stop: Event) -> Iterator[Arrival]:
        with socket.socket(socket.AF_INET6 if ":" in self.host else socket.AF_INET, socket.SOCK_DGRAM) as here:
            told = self._prepare(here)
            here.settimeout(PATIENCE)
            before = 0
            while not stop.is_set():
                try:
                    data, ancillary, _, sender = here.recvmsg(LARGEST, socket.CMSG_SPACE(4))
                except TimeoutError:
                    continue
                total = before
                for level, kind, content in ancillary:
                    if (level, kind) == (socket.SOL_SOCKET, SO_RXQ_OVFL):
                        total = struct.unpack("I", content[:4])[0]
                lost = (total - before) % 2**32 if told else None
                before = total
                yield Arrival(data, now(), f"{sender[0]}:{sender[1]}", None, lost)

    def _prepare(self, here: socket.socket) -> bool:
        """Bind the socket; return whether the system tells what it drops."""
        try:
            here.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self.room)
            if _is_group(self.host):
                here.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                here.bind((self.host, self.port))
                group = socket.inet_aton(self.host) + socket.inet_aton(self.interface)
                here.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
            else:
                here.bind((self.host, self.port))
        except OSError as error:
            raise InputError(f"udp {self.host}:{self.port}: cannot be listened to: {error.strerror or error}") from None
        try:
            here.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        except OSError:
            return False
        return True


def _is_group(host: str) -> bool:
    try:
        return ip_address(host).is_multicast
    except ValueError:
        return False
