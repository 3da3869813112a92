"""Brokers: the Kafka input of docs/live.md on librdkafka's mock brokers, MQTT through a real one."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from time import sleep
from typing import Any

import pytest

from support.paths import ROOT
from support.services import PATIENCE, TRACKER, as_json, connected, free_port, lines, served, undisturbed, wait_for
from vedette.streams import Input
from vedette_live.inputs.mqtt import MqttInput
from vedette_live.outputs.sockets import MqttOutput
from vedette_live.running import Running


@contextmanager
def heard(given: Input, of: str = "data") -> Iterator[list[Any]]:
    """Collect what an input brings; it has ended when this does."""
    stop, came = Event(), list[Any]()

    def listen() -> None:
        came.extend(getattr(arrival, of) for arrival in given.listen(stop))

    thread = Thread(target=listen, daemon=True)
    thread.start()
    try:
        yield came
    finally:
        stop.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()


@pytest.mark.costly
def test_a_third_partys_kafka_input_reads_a_topic() -> None:
    """The code block of the docs, as it stands there, on brokers that speak the protocol within this process."""
    kafka = pytest.importorskip("confluent_kafka")
    text = (ROOT / "docs" / "live.md").read_text(encoding="utf-8")
    (block,) = [each for each in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "KafkaInput" in each]
    scope: dict[str, Any] = {"__name__": "third_party"}
    exec(compile(block, "live.md", "exec"), scope)
    producer = kafka.Producer({"bootstrap.servers": "unused", "test.mock.num.brokers": 2, "log_level": 0})
    (broker, *_) = producer.list_topics(timeout=PATIENCE).brokers.values()
    told = lines(30)
    for line in told[:20]:
        producer.produce("radar", line, partition=0)
    assert producer.flush(PATIENCE) == 0
    with heard(scope["KafkaInput"](topic="radar", servers=f"{broker.host}:{broker.port}")) as came:
        wait_for(lambda: len(came) == 20)
        for line in told[20:]:
            producer.produce("radar", line, partition=0)
        assert producer.flush(PATIENCE) == 0
        wait_for(lambda: len(came) == 30)
    assert came == told


@contextmanager
def broker(port: int, folder: Path) -> Iterator[None]:
    """Run mosquitto, a broker of MQTT."""
    program = shutil.which("mosquitto", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
    if program is None:
        pytest.skip("needs the broker mosquitto, as from Debian's package of that name")
    conf = folder / "mosquitto.conf"
    conf.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\n")
    process = subprocess.Popen([program, "-c", str(conf)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        connected(port).close()
        yield
    finally:
        process.terminate()
        process.wait(PATIENCE)


def exchange(port: int, running: Running, part: list[bytes]) -> None:
    """Publish lines, and wait until the tracks after the last one have come."""
    paho = pytest.importorskip("paho.mqtt.client")
    counts, got = running.counters.counts, list[bytes]()
    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    client.on_message = lambda client, data, message: got.append(message.payload)
    client.connect("127.0.0.1", port)
    client.subscribe("tracks")
    client.loop_start()
    before, taken = counts["pieces_total"], counts["scans_taken_total"]

    def reached() -> bool:
        client.publish("radar/north", b"?")
        sleep(0.1)
        return counts["pieces_total"] > before

    wait_for(reached)
    for line in part:
        client.publish("radar/north", line)
    wait_for(lambda: counts["scans_taken_total"] == taken + len(part))
    wait_for(lambda: bool(got) and json.loads(got[-1])["time"] == json.loads(part[-1])["time"])
    client.loop_stop()
    client.disconnect()


@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.nightly("waits for a broker that went away"))])
def test_scans_come_and_tracks_go_through_a_broker(tmp_path: Path, times: int) -> None:
    """The broker starts after the service; one that is gone for a while is connected to again."""
    port, told = free_port(), lines(60)
    place = {"kind": "mqtt", "port": port}
    config = {
        **TRACKER,
        "inputs": [{"input": {**place, "topic": "radar/+"}, "format": {"kind": "json_lines"}}],
        "outputs": [{"output": {**place, "topic": "tracks"}, "format": {"kind": "json_lines"}}],
    }
    with served(config) as running:
        for k in range(times):
            with broker(port, tmp_path):
                exchange(port, running, told[60 // times * k : 60 // times * (k + 1)])
    assert as_json(running.state) == as_json(undisturbed(told))


@contextmanager
def answering(code: int) -> Iterator[tuple[int, list[bytes]]]:
    """A broker that answers whoever connects with so much, 0 for yes, and keeps what comes then; its port."""
    came = list[bytes]()

    def serve() -> None:
        here, _ = server.accept()
        with here:
            here.recv(1000)
            here.sendall(bytes([0x20, 2, 0, code]))
            while data := here.recv(1000):
                came.append(data)

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = Thread(target=serve, daemon=True)
        thread.start()
        yield server.getsockname()[1], came
        thread.join(PATIENCE)


def test_what_is_sent_first_waits_for_a_broker_that_is_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """One some ms away was never connected to again: each report ended the attempt of the one before."""
    pytest.importorskip("paho.mqtt.client")
    connect = socket.create_connection

    def slowly(*given: Any, **more: Any) -> socket.socket:
        sleep(0.1)
        return connect(*given, **more)

    monkeypatch.setattr(socket, "create_connection", slowly)
    with answering(0) as (port, came), MqttOutput(topic="tracks", port=port).open() as send:
        send(b"the first report")
        wait_for(lambda: b"the first report" in b"".join(came))


def test_an_output_says_why_there_is_no_connection() -> None:
    pytest.importorskip("paho.mqtt.client")
    with answering(5) as (port, _):
        for at, why in ((port, "Not authorized"), (free_port(), "refused")):
            with pytest.raises(OSError, match=rf"not connected: .*{why}"), MqttOutput(topic="tracks", port=at).open():
                pass


def test_an_input_says_why_there_is_no_connection() -> None:
    """A wrong password, or a name that nobody has: nothing was told at all."""
    pytest.importorskip("paho.mqtt.client")

    with answering(5) as (port, _):
        for at, why in ((port, "Not authorized"), (free_port(), "refused")):
            with heard(MqttInput(topic="radar/+", port=at), "unwell") as told:
                wait_for(lambda why=why, told=told: why in "".join(told))  # type: ignore[misc]


@pytest.mark.parametrize("topic", ["", "radar/#/north", "radar+", "#radar", "a\0b"])
def test_a_topic_that_no_broker_takes_is_refused(topic: str) -> None:
    """It ended the thread that listens, with a traceback, and the service went on without it."""
    for kind in (MqttInput, MqttOutput):
        with pytest.raises(ValueError, match="topic: must"):
            kind(topic=topic, port=1)


def test_what_a_broker_takes_is_taken() -> None:
    for topic in ("radar", "radar/+", "+/radar", "#", "radar/#", "+/+/#", "/", "$SYS/#"):
        assert MqttInput(topic=topic, port=1).topic == topic
    assert MqttOutput(topic="tracks/north", port=1).topic == "tracks/north"
