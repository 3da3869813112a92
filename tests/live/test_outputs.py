"""Outputs: files that are moved away, sockets that come and go, browsers."""

from __future__ import annotations

import errno
import logging
import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from attrs import frozen

from support.services import PATIENCE, free_port
from vedette import ConfigError, Space
from vedette.streams import Output, TrackReport
from vedette_live.addresses import Security
from vedette_live.config import Sink
from vedette_live.counters import Counters
from vedette_live.formats.json_lines import JsonLines
from vedette_live.outputs.files import FileOutput
from vedette_live.outputs.sockets import TcpServerOutput, UdpOutput, pieces
from vedette_live.outputs.websocket import WebSocketOutput
from vedette_live.sending import Sending


@frozen
class Disk(Output):
    """Takes reports where a byte is left."""

    kind: ClassVar[str] = "test_disk"
    left: list[int]

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        def send(data: bytes) -> None:
            if not self.left[0]:
                raise OSError(errno.ENOSPC, "No space left on device")

        yield send


def test_a_file_that_was_moved_away_is_begun_anew_and_a_link_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "tracks"
    with FileOutput(path=str(path)).open() as send:
        send(b"one\n")
        path.rename(tmp_path / "old")
        send(b"two\n")
    assert ((tmp_path / "old").read_bytes(), path.read_bytes()) == (b"one\n", b"two\n")
    link = tmp_path / "link"
    link.symlink_to(path)
    with pytest.raises(ConfigError), FileOutput(path=str(link)).open():
        pass
    assert path.read_bytes() == b"two\n"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["link", "old", "tracks"]


def test_a_report_that_a_full_disk_takes_in_part_is_no_half_line(tmp_path: Path) -> None:
    """A limit on the file's size stands for the disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with FileOutput(path=str(tmp_path / "tracks")).open() as send:
        send(b"one\n")
        resource.setrlimit(resource.RLIMIT_FSIZE, (6, hard))
        try:
            with pytest.raises(OSError, match="too large"):
                send(b"two\n")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        send(b"three\n")
    assert (tmp_path / "tracks").read_bytes() == b"one\nthree\n"


@pytest.mark.costly
def test_a_disk_that_stays_full_is_logged_once_and_told_until_a_report_is_taken(caplog: pytest.LogCaptureFixture) -> None:
    """It was logged at each report, five times a second, and all was well in between: the file opens, which was enough."""
    left = [0]
    ails: dict[str, str] = {}
    sending = Sending(Sink(Disk(left), JsonLines(), confirmed=False), Counters(), 0, ails)
    one = np.zeros(1)
    report = TrackReport(
        1, 0.0, Space.of(x="m"), one.astype(np.int64), one[:, None], np.ones((1, 1, 1)), one + 1.0, one == 0.0
    )

    def sent(count: int) -> None:
        for _ in range(count):
            sending.put(report, lambda moment: report)
            time.sleep(0.3)

    with caplog.at_level(logging.ERROR, "vedette.live"):
        sent(2)
        assert list(ails) == ["output 0"]
        assert [record.message for record in caplog.records] == ["output failed"]
        left[0] = 1
        sent(1)
        assert ails == {}
        sending.close()


def test_a_file_that_another_writes_is_left_alone(tmp_path: Path) -> None:
    output = FileOutput(path=str(tmp_path / "tracks"))
    with output.open() as send:
        with pytest.raises(ConfigError), output.open():
            pass
        send(b"one\n")
    assert (tmp_path / "tracks").read_bytes() == b"one\n"


def test_long_reports_are_parted_at_line_ends() -> None:
    data = b"".join(b"%04d" % i + b"x" * 295 + b"\n" for i in range(20))
    parts = pieces(data)
    assert b"".join(parts) == data
    assert all(len(part) <= 1400 and part.endswith(b"\n") for part in parts)
    assert pieces(b"y" * 5000) == [b"y" * 5000]


def test_datagrams_arrive() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        here.bind(("127.0.0.1", 0))
        here.settimeout(PATIENCE)
        with UdpOutput(port=here.getsockname()[1]).open() as send:
            send(b"hello")
        assert here.recv(100) == b"hello"


def test_a_reader_that_goes_away_takes_nothing_from_the_others() -> None:
    port = free_port()
    with TcpServerOutput(port=port).open() as send:
        first, second = (socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) for _ in range(2))
        with first, second:
            got, last = b"", time.monotonic() + PATIENCE
            second.settimeout(0.01)
            while not got and time.monotonic() < last:  # until both are taken
                send(b".")
                with suppress(TimeoutError):
                    got += second.recv(100)
            first.close()
            second.settimeout(PATIENCE)
            send(b"a")
            send(b"b\n")
            while not got.endswith(b"\n"):
                got += second.recv(100)
            assert got.strip(b".") == b"ab\n"


def test_a_browser_of_another_origin_and_a_wrong_token_are_refused(tmp_path: Path) -> None:
    client = pytest.importorskip("websockets.sync.client")
    exceptions = pytest.importorskip("websockets.exceptions")
    token = tmp_path / "token"
    token.write_text("correct horse battery staple")
    port = free_port()
    output = WebSocketOutput(port=port, security=Security(token_file=str(token)))
    right = {"Authorization": "Bearer correct horse battery staple"}
    with output.open() as send:
        place = f"ws://127.0.0.1:{port}/"
        for wrong in ({}, {"Authorization": "Bearer x"}, {**right, "Origin": "http://evil.example"}):
            with pytest.raises(exceptions.InvalidStatus):
                client.connect(place, additional_headers=wrong, open_timeout=PATIENCE)
        with client.connect(place, additional_headers=right, open_timeout=PATIENCE) as here:
            for _ in range(2000):
                send(b'{"number": 1}\n')
                try:
                    assert here.recv(timeout=0.02) == '{"number": 1}\n'
                    break
                except TimeoutError:
                    continue
            else:
                pytest.fail("nothing came")
