"""The server: for this machine, its own page and those who know the path; a slow reader holds nobody up."""

import socket
from http.client import HTTPConnection
from threading import active_count

import numpy as np
import pytest

from vedette.types import Frame
from vedette_report.watching.journal import Journal
from vedette_report.watching.server import READERS, Server


@pytest.fixture
def journal():
    return Journal()


@pytest.fixture
def server(journal):
    server = Server("<p>the page</p>", journal, lambda frame: {"png": str(frame.pixels[0, 0])})
    yield server
    journal.end("ended")
    server.close(0.2)


def ask(server, path="", method="GET", **headers):
    """The answer to a request, with its status."""
    connection = HTTPConnection("127.0.0.1", server._local.port, timeout=10)
    own = {"Host": server._local.hosts[0]} | {name.replace("_", "-"): value for name, value in headers.items()}
    connection.putrequest(method, f"/{server._local.token}/{path}", skip_host=True)
    for name, value in own.items():
        connection.putheader(name, value)
    connection.endheaders()
    return connection.getresponse()


def read(answer, ends):
    """What an answer says until a text."""
    found = b""
    while ends not in found:
        part = answer.read1(65536)
        assert part, found
        found += part
    return found


def test_it_listens_on_the_loopback_interface_alone_under_a_path_that_cannot_be_guessed(server, journal):
    assert server._local._http.server_address[0] == "127.0.0.1"
    assert server.address == f"http://127.0.0.1:{server._local.port}/{server._local.token}/"
    other = Server("", journal, lambda frame: {})
    other.close(0.0)
    assert len(server._local.token) >= 20
    assert server._local.token != other._local.token


def test_the_page_is_served_with_what_keeps_it_to_itself(server):
    answer = ask(server)
    assert (answer.status, answer.read()) == (200, b"<p>the page</p>")
    assert answer.headers["X-Frame-Options"] == "DENY"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "Access-Control-Allow-Origin" not in answer.headers


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_this_machine_s_own_names_are_answered(server, name):
    host = f"{name}:{server._local.port}"
    assert ask(server, Host=host, Origin=f"http://{host}", Sec_Fetch_Site="same-origin").status == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "127.0.0.1"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
    ],
)
@pytest.mark.parametrize("path", ["", "events"])
def test_other_hosts_and_origins_are_refused(server, path, headers, status):
    answer = ask(server, path, **headers)
    assert answer.status == status
    assert b"the page" not in answer.read()
    assert not server.greeted.is_set()


def test_without_the_token_there_is_nothing_and_only_get_is_understood(server):
    for path in (
        "/",
        "/events",
        f"/{server._local.token}",
        f"/{server._local.token}/x",
        f"/{server._local.token[:-1]}x/",
        f"/{server._local.token}/../",
    ):
        connection = HTTPConnection("127.0.0.1", server._local.port)
        connection.request("GET", path, headers={"Host": server._local.hosts[0]})
        assert connection.getresponse().status == 404, path
    assert ask(server, method="POST").status == 501


def test_a_reader_gets_what_was_before_it_what_comes_and_the_end(server, journal):
    journal.add(b"A" * 24, 2)
    answer = ask(server, "events")
    assert read(answer, b"\n\n") == b"id: 2\ndata: " + b"A" * 24 + b"\n\n"
    journal.add(b"B" * 24, 1, Frame(np.full((2, 2), 7)))
    journal.end("ended")
    text = read(answer, b"ended\n\n")
    assert text.split(b"\n\n")[:-1] == [
        b'event: picture\ndata: {"scan": 2, "png": "7"}',
        b"id: 3\ndata: " + b"B" * 24,
        b"event: ended\ndata: ended",
    ]
    assert answer.read() == b""


@pytest.mark.parametrize(("last", "begin"), [("2", 2), ("99", 3), ("-1", 0), ("x", 0), ("9" * 40, 0)])
def test_a_reader_that_lost_its_connection_goes_on_where_it_was(server, journal, last, begin):
    for letter in (b"A", b"B", b"C"):
        journal.add(letter * 24, 1)
    journal.end("ended")
    text = ask(server, "events", Last_Event_ID=last).read()
    assert [letter in text for letter in (b"AAA", b"BBB", b"CCC")] == [begin <= i for i in range(3)]


def test_a_reader_that_does_not_read_holds_nobody_up_and_gets_all_later(server, journal):
    with socket.create_connection(("127.0.0.1", server._local.port)) as lazy:
        lazy.sendall(f"GET /{server._local.token}/events HTTP/1.1\r\nHost: {server._local.hosts[0]}\r\n\r\n".encode())
        record = b"A" * 240_000
        for _ in range(100):  # it would not come to their end if it waited for the one that does not read
            journal.add(record, 1)
        quick = ask(server, "events")
        size = 0
        while size < 100 * len(record):
            size += len(quick.read1(1 << 20))
        journal.end("ended")
        lazy.settimeout(20)
        got = 0
        while part := lazy.recv(1 << 20):
            got += part.count(b"A")
    assert got == 100 * len(record)


def test_there_is_an_end_to_how_many_read_at_once(server):
    threads = active_count()
    answers = [ask(server, "events") for _ in range(READERS)]
    assert {answer.status for answer in answers} == {200}
    assert ask(server, "events").status == 503
    assert active_count() <= threads + READERS + 1


def test_closing_lets_readers_take_what_is_left_and_waits_for_no_one_for_ever(journal):
    server = Server("", journal, lambda frame: {})
    answer = ask(server, "events")
    journal.add(b"A" * 24, 1)
    journal.end("ended")
    server.close(5.0)
    assert answer.read().endswith(b"event: ended\ndata: ended\n\n")
    stuck = Server("", Journal(), lambda frame: {})
    ask(stuck, "events")
    stuck.close(0.2)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", stuck._local.port), timeout=1)
