"""Live services in tests: their tracker, what is sent to them, and patience with a busy machine."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

import vedette
from vedette.streams import Arrival, Input
from vedette.tracking import State
from vedette_live.config import load_service
from vedette_live.running import Running

PATIENCE = 60.0
"""s after which what has not happened never will."""

TRACKER: Mapping[str, Any] = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
    "sensors": {
        "north": {"kind": "cartesian_position", "sigma": 8.0, "detection_probability": 0.9, "clutter_density": 2e-7},
        "south": {"kind": "cartesian_position", "sigma": 15.0, "detection_probability": 0.9, "clutter_density": 2e-7},
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 4.0, "vy": 4.0}},
    "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.99, "delete": 0.01},
}


_PORTS = iter(range(10_240 + os.getpid() * 97 % 20_000, 32_000))
"""Below those that the system gives to clients; each process of a test run begins elsewhere."""


def free_port() -> int:
    """Return a port that nobody listens to, for datagrams and connections, and that no later call returns."""
    for port in _PORTS:
        try:
            for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
                with socket.socket(socket.AF_INET, kind) as here:
                    here.bind(("127.0.0.1", port))
        except OSError:
            continue
        return port
    raise AssertionError("no port is free")


def lines(count: int = 80) -> list[bytes]:
    """Return scans of two objects as JSON lines, of two sensors in turn."""
    rng = np.random.default_rng(3)
    start, velocity = np.array([[-800.0, -400.0], [600.0, -900.0]]), np.array([[4.0, 2.0], [-2.0, 4.0]])
    out = []
    for k in range(count):
        places = start + 1.5 * k * velocity
        z = [list(place + rng.normal(0, 8, 2)) for place in places if rng.random() < 0.9]
        told = {"time": 1.5 * k, "sensor": ("south", "north")[k % 2], "z": z, "n": k}
        out.append(json.dumps(told).encode() + b"\n")
    return out


@contextmanager
def served(config: Mapping[str, Any]) -> Iterator[Running]:
    """Run a service in a thread; it has ended when this does."""
    running = Running(load_service(config))
    failed = list[BaseException]()

    def run() -> None:
        try:
            running.run()
        except BaseException as error:
            failed.append(error)

    thread = Thread(target=run, daemon=True)
    thread.start()
    try:
        yield running
    finally:
        running.stop.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()
    if failed:
        raise failed[0]


def wait_for(what: Callable[[], Any], timeout: float = PATIENCE) -> None:
    """Wait until something holds."""
    end = monotonic() + timeout
    while not what():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.01)


def connected(port: int) -> socket.socket:
    """Return a connection, as soon as the service takes one."""
    end = monotonic() + PATIENCE
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        except OSError:
            assert monotonic() < end
            sleep(0.02)


def reach(running: Running, port: int) -> socket.socket:
    """Return a socket for datagrams to a port, as soon as the service reads what comes; so far it has refused all."""
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    here.connect(("127.0.0.1", port))

    def arrived() -> bool:
        with suppress(OSError):  # nobody listens yet
            here.send(b"?")
        return running.counters.counts["pieces_total"] > 0

    wait_for(arrived)
    return here


@final
@frozen
class Scripted(Input):
    """Arrivals that are given."""

    kind: ClassVar[str] = "scripted"
    datagrams: ClassVar[bool] = True

    arrivals: Iterable[Arrival]

    def listen(self, stop: Event) -> Iterator[Arrival]:
        yield from self.arrivals


def made(config: Mapping[str, Any], *inputs: Iterable[Arrival]) -> Running:
    """Return a service that has not begun, with arrivals that are given in the place of its inputs."""
    service = load_service(config)
    feeds = tuple(evolve(feed, input=Scripted(given)) for feed, given in zip(service.parts.inputs, inputs, strict=True))
    return Running(evolve(service, parts=evolve(service.parts, inputs=feeds)))


def ran(config: Mapping[str, Any], *inputs: Iterable[Arrival]) -> Running:
    """Run a service to its end on arrivals that are given."""
    running = made(config, *inputs)
    running.run()
    return running


def feed(**more: Any) -> dict[str, Any]:
    """Return an input whose bytes are given, of JSON lines unless told."""
    return {"input": {"kind": "standard_input"}, "format": {"kind": "json_lines"}, **more}


def undisturbed(told: Iterable[bytes], tracker: Mapping[str, Any] = TRACKER) -> State:
    """Return the state after these lines, taken in order by the library."""
    built = vedette.build(tracker)
    state = built.start(seed=np.random.SeedSequence(0).spawn(2)[1])
    for line in told:
        scan = json.loads(line)
        state = built.step(state, vedette.Scan(scan["time"], scan["sensor"], vedette.Detections.of(scan["z"], 2)))
    return state


def as_json(state: State | None) -> str:
    """Return a state as text, to the last bit."""
    assert state is not None
    return json.dumps(state.to_data())


def replayed(record: Path, config: Mapping[str, Any]) -> State:
    """Return the last state of `vedette run` on a record."""
    steps = vedette.load({**config, "source": {"kind": "jsonl", "path": str(record)}}).steps()
    return [state for _, state in steps][-1]
