"""The page on which boxes are drawn: what it shows, what it takes, and from whom."""

import json
from http.client import HTTPConnection
from threading import Event, Thread

import numpy as np
import pytest

from support.browser import LACKING, browser
from vedette.types import Frame
from vedette_report.watching.picking import MOST, Picking


@pytest.fixture
def picking():
    pixels = np.random.default_rng(0).integers(0, 255, (60, 80), dtype=np.uint8)
    with Picking("<clip>", Frame(pixels)) as page:
        yield page


def ask(picking, name="", body=None, **headers):
    connection = HTTPConnection("127.0.0.1", picking._local.port, timeout=10)
    own = {"Host": picking._local.hosts[0]} | {key.replace("_", "-"): value for key, value in headers.items()}
    connection.request("GET" if body is None else "POST", f"/{picking._local.token}/{name}", body, own)
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def test_the_page_shows_the_frame_and_its_name(picking):
    status, text = ask(picking)
    assert status == 200
    assert 'viewBox="0 0 80 60"' in text
    assert "Targets in &lt;clip&gt;" in text
    assert "data:image/png;base64," in text
    assert "<!-- " not in text


def test_boxes_are_waited_for_and_taken(picking):
    found = []
    waiting = Thread(target=lambda: found.extend(picking.boxes()))
    waiting.start()
    assert ask(picking, "boxes", json.dumps([[1, 2.5, 10, 20], [60, 40, 20, 20]])) == (200, "taken")
    waiting.join(5.0)
    assert found == [(1.0, 2.5, 10.0, 20.0), (60.0, 40.0, 20.0, 20.0)]


@pytest.mark.parametrize(
    "given",
    [
        *([], {}, [1, 2, 3, 4], [[1, 2, 3]], [[1, 2, 3, "4"]], [[1, 2, True, 4]], [[1, 2, float("nan"), 4]]),
        *([[70, 2, 11, 4]], [[-1, 2, 3, 4]], [[1, 57, 3, 4]], [[1, 2, 0.5, 4]], [[1, 2, 3, 4]] * (MOST + 1)),
    ],
)
def test_what_is_no_box_in_the_frame_is_refused(picking, given):
    assert ask(picking, "boxes", json.dumps(given))[0] == 400
    assert picking.boxes(lambda drawn: None) == []
    assert not picking._drawn.is_set()


def test_what_is_no_json_is_refused(picking):
    assert ask(picking, "boxes", b"\xff[")[0] == 400
    assert ask(picking, "boxes", b"[" * 7000)[0] == 400
    assert ask(picking, "", b"[]")[0] == 400


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}])
def test_other_sites_are_refused(picking, headers):
    for body in (None, "[[1, 2, 3, 4]]"):
        assert ask(picking, "" if body is None else "boxes", body, **headers)[0] in (403, 421)
    assert not picking._drawn.is_set()


@pytest.mark.skipif(LACKING is not None, reason=str(LACKING))
@pytest.mark.costly
def test_a_box_is_drawn_in_a_browser(picking):
    done = Event()
    with browser() as running:
        tab = running.new_page(viewport={"width": 1000, "height": 800})
        tab.goto(picking.address)
        seen = tab.locator("#frame img").bounding_box()
        scale = seen["width"] / 80
        tab.mouse.move(seen["x"] + 10 * scale, seen["y"] + 20 * scale)
        tab.mouse.down()
        tab.mouse.move(seen["x"] + 30 * scale, seen["y"] + 35 * scale)
        tab.mouse.up()
        tab.get_by_role("button", name="Follow").click()
        tab.get_by_text("Taken").wait_for()
        done.set()
    assert done.is_set()
    assert np.abs(np.array(picking.boxes(lambda drawn: drawn.wait(5.0))) - [[10.0, 20.0, 20.0, 15.0]]).max() < 0.5
