"""The first frame of a video on a page of this machine, in which somebody draws boxes around targets."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from html import escape
from importlib.resources import files
from threading import Event
from typing import Any, ClassVar, final

from vedette.types import Frame
from vedette_report.page.frames import limits_of, picture
from vedette_report.watching.local import LocalHandler, LocalServer

MOST = 100
"""Boxes that may be drawn."""

_FINE = 2048
"""Pixels of the longer side of a frame that is shown as it is."""

_LONGEST = 64 * MOST
"""Bytes of an answer, at most."""

Box = tuple[float, float, float, float]


@final
class Picking:
    """Shows a frame at `address` until boxes have been drawn in it: x, y of the first corner, width, height in px.

    The first pixel's outer corner is at 0, 0. Use it in a `with` block.
    """

    def __init__(self, title: str, frame: Frame, port: int = 0) -> None:
        self.height, self.width = frame.pixels.shape[-2:]
        shown = picture(frame, limits_of(frame), fine=_FINE)
        made = files(__package__).joinpath("picking.html").read_text(encoding="utf-8")
        facts = {"TITLE": escape(title), "PNG": shown["png"], "WIDTH": str(self.width), "HEIGHT": str(self.height)}
        for name, value in facts.items():
            made = made.replace(f"<!-- {name} -->", value)
        self.page, self._drawn, self._boxes = made.encode(), Event(), list[Box]()
        self._local = LocalServer(_Handler, self, port)
        self.address = self._local.address

    def boxes(self, wait: Callable[[Event], object] = Event.wait) -> list[Box]:
        """Return the boxes once they are drawn; none if `wait` ends before that."""
        wait(self._drawn)
        return list(self._boxes)

    def take(self, text: bytes) -> str | None:
        """Take the answer of the page; return what is wrong with it, None if nothing is."""
        try:
            given = json.loads(text)
        except ValueError:
            return "must be JSON"
        if not isinstance(given, list) or not 1 <= len(given) <= MOST:
            return f"must be a list of 1 to {MOST} boxes"
        boxes = list[Box]()
        for box in given:
            if not isinstance(box, list) or len(box) != 4 or not all(_is_number(value) for value in box):
                return "a box must be [x, y, width, height], four numbers"
            x, y, w, h = map(float, box)
            if min(w, h) < 1 or x < 0 or y < 0 or x + w > self.width or y + h > self.height:
                return f"a box must lie in the frame of {self.width} x {self.height} px and be 1 px wide and high"
            boxes.append((x, y, w, h))
        self._boxes = boxes
        self._drawn.set()
        return None

    def __enter__(self) -> Picking:
        return self

    def __exit__(self, *_: Any) -> None:
        self._local.close()


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class _Handler(LocalHandler):
    """Answers one request; `own` is whose boxes it takes."""

    own: Picking
    names: ClassVar[tuple[str, ...]] = ("", "boxes")

    def do_GET(self) -> None:
        """Answer with the page."""
        if not self.refuses():
            self.head("text/html; charset=utf-8")
            self.wfile.write(self.own.page)

    def do_POST(self) -> None:
        """Take the boxes."""
        if self.refuses():
            return
        size = self.headers.get("Content-Length", "")
        if not self.path.endswith("/boxes") or not size.isdecimal() or len(size) > 9 or int(size) > _LONGEST:
            self.send_error(400, "Boxes alone are taken")
            return
        wrong = self.own.take(self.rfile.read(int(size)))
        if wrong is not None:
            self.send_error(400, wrong)
            return
        self.head("text/plain; charset=utf-8")
        self.wfile.write(b"taken")
