"""`vedette replay`: recordings, sent as they came."""

from __future__ import annotations

import json
import select
import socket
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from vedette.commands import DONE, INTERRUPTED, options
from vedette.errors import ConfigError
from vedette.types import Recording
from vedette_files import FRAMES, read_recording, scan_line
from vedette_live.inputs.tcp import PIECE
from vedette_report.watching.real_time import Pace, read_speed

PATIENCE = 10.0
"""s for a connection, and for an answer at the end."""


def run(arguments: Namespace) -> int:
    """Send all scans; return 130 if Ctrl-C ended it early."""
    speed = options.read("--speed", arguments.speed, read_speed) or 1.0
    recordings = [read_recording(Path(file)) for file in arguments.files]
    for file, (recording, _) in zip(arguments.files, recordings, strict=True):
        if not _frame(recording):
            print(f"{file}: does not say where x and y point: whoever takes it must know", file=sys.stderr)
    numbers = count()
    try:
        with _sender(arguments.to) as send:
            for recording, spaces in recordings:
                for scan in Pace(speed)(recording.scans, "sending"):
                    line = {**json.loads(scan_line(scan, spaces)), **_frame(recording), "n": next(numbers)}
                    send((json.dumps(line) + "\n").encode())
    except KeyboardInterrupt:
        return INTERRUPTED
    return DONE


def _frame(recording: Recording) -> dict[str, str]:
    """Return what a recording's lines tell of where x and y point."""
    return {name: note for name, note in recording.notes.items() if name == "frame" and note in FRAMES}


@contextmanager
def _sender(address: str) -> Iterator[Callable[[bytes], None]]:
    """Open what sends to an address; ConfigError if it is none."""
    if address == "-":

        def write(data: bytes) -> None:
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()

        yield write
        return
    kind, _, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if kind not in ("udp", "tcp") or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        told = f"must be udp://HOST:PORT, tcp://HOST:PORT or -, got {address!r}"
        raise ConfigError.at("--to", told)
    try:
        if kind == "udp":
            with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM) as here:
                here.connect((host.strip("[]"), int(port)))
                yield here.sendall
        else:
            with socket.create_connection((host.strip("[]"), int(port)), timeout=PATIENCE) as connection:

                def numbered(data: bytes) -> None:
                    connection.sendall(data)
                    _read_answers(connection, 0.0)

                yield numbered
                connection.shutdown(socket.SHUT_WR)
                _read_answers(connection, PATIENCE)
    except OSError as error:
        raise ConfigError.at("--to", f"{address}: {error.strerror or error}") from None


def _read_answers(connection: socket.socket, patience: float) -> None:
    """Read until nothing comes: whoever closes with answers unread throws away what is still on its way."""
    while select.select([connection], [], [], patience)[0] and connection.recv(PIECE):
        pass
