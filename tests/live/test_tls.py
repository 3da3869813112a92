"""Connections are encrypted, both ways, and one that is not is refused."""

from __future__ import annotations

import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Callable
from typing import Any

import pytest

from support.services import PATIENCE, TRACKER, free_port, lines, served, wait_for
from vedette import InputError
from vedette_live.addresses import Security
from vedette_live.outputs.sockets import TcpClientOutput, TcpServerOutput
from vedette_live.outputs.websocket import WebSocketOutput

if shutil.which("openssl") is None:
    pytest.skip("openssl makes the certificates", allow_module_level=True)


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """A certificate of 127.0.0.1 that certifies itself, and its key."""
    key, certificate = (str(tmp_path_factory.mktemp("tls") / name) for name in ("key.pem", "own.pem"))
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=own"]
    named = ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", certificate]
    subprocess.run([*made, *named], check=True, capture_output=True)
    return certificate, key


def test_an_input_takes_encrypted_connections_alone(pair: tuple[str, str]) -> None:
    certificate, key = pair
    port = free_port()
    given = {"kind": "tcp_server", "port": port, "security": {"certificate": certificate, "key": key}}
    with served({**TRACKER, "inputs": [{"input": given, "format": {"kind": "json_lines"}}]}) as running:
        wait_for(lambda: _listens(port))
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as plain:
            plain.sendall(lines(1)[0])
            assert plain.recv(100)[:1] in (b"", b"\x15"), "an alert, or nothing"
        with TcpClientOutput(port=port, tls=True, security=Security(authority=certificate)).open() as send:
            for line in lines(3):
                send(line)
            wait_for(lambda: running.counters.counts["scans_taken_total"] == 3)
    assert running.counters.counts["messages_total"] == 3


def test_who_is_not_trusted_is_not_sent_anything(pair: tuple[str, str]) -> None:
    certificate, key = pair
    port = free_port()
    own = Security(certificate=certificate, key=key)
    with TcpServerOutput(port=port, security=own).open(), pytest.raises(ssl.SSLCertVerificationError):
        TcpClientOutput(port=port, tls=True).open().__enter__()
    with pytest.raises(InputError, match=r"certificate: .*cannot be used"):
        Security(certificate=key, key=key).server()


def test_outputs_are_read_encrypted(pair: tuple[str, str]) -> None:
    certificate, key = pair
    own, context = Security(certificate=certificate, key=key), ssl.create_default_context(cafile=certificate)
    port = free_port()
    with (
        TcpServerOutput(port=port, security=own).open() as send,
        context.wrap_socket(socket.create_connection(("127.0.0.1", port)), server_hostname="127.0.0.1") as here,
    ):
        here.settimeout(0.05)
        assert _heard(send, lambda: here.recv(9)) == b"a report\n"
    client = pytest.importorskip("websockets.sync.client")
    port = free_port()
    with (
        WebSocketOutput(port=port, security=own).open() as send,
        client.connect(f"wss://127.0.0.1:{port}/", ssl=context, open_timeout=PATIENCE) as here,
    ):
        assert _heard(send, lambda: here.recv(timeout=0.05)) == "a report\n"


def _heard(send: Callable[[bytes], None], hear: Callable[[], Any]) -> Any:
    """Send until a reader that has just come hears it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        send(b"a report\n")
        try:
            return hear()
        except TimeoutError:
            continue
    return None


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
    except OSError:
        return False
    return True
