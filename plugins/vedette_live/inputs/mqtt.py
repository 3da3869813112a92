"""Messages of a broker of MQTT."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, Full, Queue
from threading import Event
from typing import Any, ClassVar, final

from attrs import evolve, frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Arrival, Input, now
from vedette_files.libraries import needed
from vedette_live.addresses import PATIENCE, Security, host_field, port_field

HELD = 4096
"""Messages that may wait; those that come then are dropped and counted."""

PAUSE = 30
"""Longest pause in s before a connection is tried again."""


@final
@frozen
class MqttInput(Input):
    """The messages of a topic, each whole in itself; a lost connection is made again. By paho-mqtt.

    OASIS, MQTT Version 5.0, 2019.
    """

    kind: ClassVar[str] = "mqtt"
    datagrams: ClassVar[bool] = True

    topic: str = fields.text("of the messages; + and # stand for any")
    port: int = port_field()
    host: str = host_field("of the broker")
    tls: bool = fields.flag("whether the connection is encrypted", default=False)
    user: str = fields.text("name of the user; the password is the token", default="")
    security: Security = fields.part("whom to trust, and the password", default=Security())

    def __attrs_post_init__(self) -> None:
        *before, last = self.topic.split("/")
        apart = all(level in ("+", "#") or not {"+", "#"} & set(level) for level in (*before, last))
        if not fits(self.topic) or not apart or "#" in before:
            told = "must be levels between /, each a name or +, the last of them may be #"
            raise ValueError(f"topic: {told}, got {self.topic!r}")

    def listen(self, stop: Event) -> Iterator[Arrival]:
        came, lost = Queue[Any](HELD), [0]
        broker = f"{self.host}:{self.port}"

        def receive(client: Any, data: Any, message: Any) -> None:
            put(Arrival(bytes(message.payload), now(), str(message.topic)))

        def put(arrival: Arrival) -> None:
            try:
                came.put_nowait(arrival)
            except Full:
                lost[0] += 1

        def tell(unwell: str) -> None:
            put(Arrival(b"", now(), broker, unwell=unwell))

        def subscribed(client: Any, data: Any, number: Any, answers: Any, more: Any) -> None:
            failures = [f"not subscribed to {self.topic!r}: {answer}" for answer in answers if answer.is_failure]
            tell("; ".join(failures))

        def connects(client: Any, why_not: str) -> None:
            if why_not:
                tell(f"not connected: {why_not}")
            else:
                client.subscribe(self.topic)

        with connected(self, connects) as client:
            client.on_message, client.on_subscribe = receive, subscribed
            client.loop_start()
            while not stop.is_set():
                try:
                    arrival = came.get(timeout=PATIENCE)
                except Empty:
                    continue
                dropped, lost[0] = lost[0], 0
                yield evolve(arrival, lost=dropped)


def fits(topic: str) -> bool:
    """Return whether a topic may be sent to a broker."""
    return 0 < len(topic.encode(errors="replace")) <= 65_535 and "\0" not in topic


@contextmanager
def connected(part: Any, connects: Callable[[Any, str], None]) -> Iterator[Any]:
    """Give a client of an MQTT part's broker, which connects in the background once its loop is started, again and again.

    `connects` is called with it in its thread, each time, and with why there is no connection, "" where there is one.
    """
    paho = needed("paho.mqtt.client", "MQTT needs paho-mqtt", "live")
    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    client.reconnect_delay_set(1, PAUSE)
    if part.user:
        token = part.security.token
        client.username_pw_set(part.user, None if token is None else token.decode(errors="replace"))
    if part.tls:
        client.tls_set_context(part.security.client())
    client.on_connect = lambda client, data, flags, answer, more: connects(client, str(answer) if answer.is_failure else "")
    client.on_connect_fail = lambda client, data: connects(client, str(sys.exc_info()[1] or "no answer"))
    try:
        part.host.encode("idna")  # in its thread it would be an error that nobody hears
        client.connect_async(part.host, part.port)
    except ValueError as error:
        raise InputError(f"mqtt {part.host}:{part.port}: {error}") from None
    try:
        yield client
    finally:
        client.loop_stop()
        client.disconnect()
