"""Messages of a broker of MQTT."""

from __future__ import annotations

from collections.abc import Iterator
from queue import Empty, Full, Queue
from threading import Event
from typing import Any, ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Arrival, Input, now
from vedette_files.libraries import needed
from vedette_live.addresses import PATIENCE, Security, host_field, port_field

HELD = 4096
"""Messages that may wait; those that come then are dropped and counted."""


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

    def listen(self, stop: Event) -> Iterator[Arrival]:
        came, lost = Queue[Any](HELD), [0]

        def receive(client: Any, data: Any, message: Any) -> None:
            try:
                came.put_nowait(Arrival(bytes(message.payload), now(), str(message.topic)))
            except Full:
                lost[0] += 1

        client = connected(self)
        client.on_message = receive
        client.on_connect = lambda *_: client.subscribe(self.topic)
        client.loop_start()
        try:
            while not stop.is_set():
                try:
                    arrival = came.get(timeout=PATIENCE)
                except Empty:
                    continue
                dropped, lost[0] = lost[0], 0
                yield Arrival(arrival.data, arrival.time, arrival.stream, None, dropped)
        finally:
            client.loop_stop()
            client.disconnect()


def connected(part: Any) -> Any:
    """Return a client of an MQTT part's broker, which connects in the background."""
    paho = needed("paho.mqtt.client", "MQTT needs paho-mqtt", "live")
    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    if part.user:
        token = part.security.token
        client.username_pw_set(part.user, None if token is None else token.decode(errors="replace"))
    if part.tls:
        client.tls_set_context(part.security.client())
    try:
        client.connect_async(part.host, part.port)
    except ValueError as error:
        raise InputError(f"mqtt {part.host}:{part.port}: {error}") from None
    return client
