"""Inputs by themselves: what the system drops is counted, a group is joined, a file is followed, and systemd is told."""

from __future__ import annotations

import errno
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any

import pytest

from support.services import PATIENCE, connected, free_port
from vedette.errors import InputError
from vedette.streams import Arrival, Input
from vedette_live.health import notify
from vedette_live.inputs.files import FileInput, StandardInput
from vedette_live.inputs.tcp import TcpServerInput
from vedette_live.inputs.udp import UdpInput
from vedette_live.outputs.sockets import TcpServerOutput

LOOPBACK = "127.0.0.1"


@contextmanager
def _listening(source: Input, resume: Event) -> Iterator[list[Arrival]]:
    """Gather what comes of an input; after the first, none before `resume` is set."""
    stop = Event()
    arrivals: list[Arrival] = []

    def gather() -> None:
        for arrival in source.listen(stop):
            arrivals.append(arrival)
            resume.wait(PATIENCE)

    thread = Thread(target=gather)
    thread.start()
    try:
        yield arrivals
    finally:
        stop.set()
        resume.set()
        thread.join(PATIENCE)


def _until(holds: Callable[[], bool], meanwhile: Callable[[], object] = lambda: None) -> None:
    end = monotonic() + PATIENCE
    while not holds():
        assert monotonic() < end
        meanwhile()
        sleep(0.01)


def _now() -> Event:
    event = Event()
    event.set()
    return event


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells how many datagrams it dropped")
def test_datagrams_that_the_system_dropped_are_counted_to_the_last() -> None:
    port, resume, sent = free_port(), Event(), 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:

        def send() -> None:
            nonlocal sent
            sent += 1
            here.sendto(b"%08d" % sent * 100, (LOOPBACK, port))

        with _listening(UdpInput(port=port, room=2**12), resume) as arrivals:
            _until(lambda: bool(arrivals), send)
            for _ in range(200):
                send()
            while_full = sent
            resume.set()
            _until(lambda: int(arrivals[-1].data[:8]) > while_full, send)
    numbers = [int(arrival.data[:8]) for arrival in arrivals]
    lost = sum(arrival.lost or 0 for arrival in arrivals)
    assert numbers[-1] - numbers[0] + 1 == len(arrivals) + lost
    assert lost > 100


def test_a_connection_too_many_is_closed_and_told(caplog: pytest.LogCaptureFixture) -> None:
    port = free_port()
    with (
        _listening(TcpServerInput(port=port, most=1), _now()) as arrivals,
        connected(port) as first,
        connected(port) as second,
    ):
        assert second.recv(1) == b""
        first.sendall(b"one\n")
        _until(lambda: bool(arrivals))
    (told,) = [vars(record) for record in caplog.records if record.getMessage() == "connection closed"]
    assert "more than `most`" in told["why"]
    assert told["from"].startswith(f"tcp {port} 127.0.0.1:")


def test_a_standard_input_that_is_closed_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(InputError):
        next(StandardInput().listen(Event()))


@pytest.mark.parametrize("side", ["input", "output"])
def test_connections_that_the_system_cannot_give_are_told_and_cost_little(
    side: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """With all open files used, it was asked for the next one without a pause, and nobody was told why none came."""
    port, asked = free_port(), list[Any]()

    def accept(server: socket.socket) -> Any:
        asked.append(server)
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(socket.socket, "accept", accept)
    server = _listening(TcpServerInput(port=port), _now()) if side == "input" else TcpServerOutput(port=port).open()
    with server, connected(port):
        _until(lambda: bool(asked))
        sleep(0.5)
    assert [record.getMessage() for record in caplog.records] == ["connection not taken"]
    assert len(asked) < 50


@pytest.mark.costly
def test_whoever_reads_no_answers_loses_the_connection_and_others_still_come() -> None:
    """The next one that came had the same file number, and ended the input."""
    port, resume = free_port(), Event()
    with _listening(TcpServerInput(port=port), resume) as arrivals, connected(port) as first:
        first.sendall(b"one\n")
        _until(lambda: bool(arrivals))
        with connected(port) as later:
            later.sendall(b"two\n")
            reply = arrivals[0].reply
            assert reply is not None
            reply(b"kept\n" * 10**7)
            resume.set()
            _until(lambda: arrivals[-1].data == b"two\n")


def test_a_multicast_group_is_joined() -> None:
    port = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
        with _listening(UdpInput(port=port, host="239.1.2.3", interface=LOOPBACK), _now()) as arrivals:
            _until(lambda: bool(arrivals), lambda: here.sendto(b"to all", ("239.1.2.3", port)))
    assert arrivals[0].data == b"to all"


def test_a_file_is_followed_and_read_anew_when_it_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "plots"
    path.write_bytes(b"old\n")
    with _listening(FileInput(path=str(path), every=0.01), _now()) as arrivals:

        def read() -> bytes:
            return b"".join(arrival.data for arrival in arrivals)

        _until(lambda: read() == b"old\n")
        with path.open("ab") as file:
            file.write(b"more\n")
        _until(lambda: read() == b"old\nmore\n")
        (tmp_path / "next").write_bytes(b"new\n")
        (tmp_path / "next").replace(path)
        _until(lambda: read() == b"old\nmore\nnew\n")
        path.write_bytes(b"cut\n"[:2])
        _until(lambda: read() == b"old\nmore\nnew\ncu")
    assert len({arrival.stream for arrival in arrivals}) == 3


def test_systemd_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notify("READY=1")  # not started by it: nothing to tell
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as here:
        here.bind(str(tmp_path / "notify"))
        here.settimeout(PATIENCE)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        notify("READY=1")
        assert here.recv(100) == b"READY=1"
    notify("STOPPING=1")  # it went away: no error
