"""NMEA 0183: reports of AIS, read by pyais; targets, written as TTM or TLL."""

from __future__ import annotations

from functools import reduce
from operator import xor
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import fields
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette_files import code
from vedette_files.input_files import shown
from vedette_files.libraries import needed
from vedette_live.formats.text import LONGEST, Rest, split

KNOT = 1852.0 / 3600.0
POSITIONS = (1, 2, 3, 18, 19, 27)
"""Message types that hold a ship's position: class A, class B, long range."""
HELD = 64
"""Messages of several sentences that may be incomplete at once; the oldest is refused beyond it."""
AXES = ("latitude", "longitude", "speed", "course")


MILLISECONDS = 1e11
"""A time beyond is one in ms: in s it would be of the year 5138."""
_Sentence = tuple[bytes, float | None]
"""A sentence, and the time of its TAG block in s since 1970, if it has one."""


@frozen
class _Memory:
    """The rest of a line, and the sentences and times of messages that are not whole: by channel and number."""

    rest: Rest = Rest()
    parts: tuple[tuple[tuple[str, str, int], tuple[tuple[int, _Sentence], ...]], ...] = ()


@final
@frozen
class Nmea(Format):
    """AIS position reports (!AIVDM, !AIVDO) as returns of latitude, longitude, speed and course; tracks as sentences.

    A report tells no time but the second; it counts from when it came, or if `tagged` from the time of the TAG block before
    it, `\\s:station,c:1700000000*5D\\`. Other sentences are passed over. `TLL` gives latitude and longitude, `TTM` distance
    in NM, bearing, speed and course as seen from the origin.
    IEC 61162-1, Maritime navigation and radiocommunication equipment - Digital interfaces, 2016.
    """

    kind: ClassVar[str] = "nmea"
    writes: ClassVar[bool] = True

    sentence: str = fields.choice("of tracks that are written", ("TLL", "TTM"), default="TLL")
    talker: str = fields.text("the two letters that say who talks, in sentences that are written", default="RA")
    tagged: bool = fields.flag("take the times of TAG blocks, as of a recorded file that has them", default=False)

    def __attrs_post_init__(self) -> None:
        if len(self.talker) != 2 or not (self.talker.isascii() and self.talker.isalpha() and self.talker.isupper()):
            raise ValueError(f"talker: must be two capital letters, got {self.talker!r}")

    def sample(self) -> bytes:
        return (
            b"!AIVDM,1,1,,B,15M67FC000G?ufbE`FepT@3n00Sa,0*5C\r\n"
            b"!AIVDM,2,1,4,A,55O0W7`00001L@gCWGA2uItLth@DqtL5@F22220j1h742t0Ht0000000,0*08\r\n"
            b"!AIVDM,2,2,4,A,000000000000000,2*20\r\n"
        )

    def start(self) -> _Memory:
        return _Memory()

    def decode(self, memory: _Memory, data: bytes) -> Decoded:
        rest, lines, too_long = split(memory.rest, data)
        memory = evolve(memory, rest=rest)
        messages, refused = list[Message](), [f"a line is longer than {LONGEST:,} bytes"] * too_long
        for line in filter(bytes.strip, lines):
            try:
                memory, sentences, dropped = _collected(memory, line, tagged=self.tagged)
                refused += dropped
                if sentences and (message := _position([sentence for sentence, _ in sentences])) is not None:
                    messages.append(evolve(message, time=next((time for _, time in sentences if time is not None), None)))
            except ValueError as error:
                refused.append(str(error))
        return Decoded(memory, messages, refused)

    def end(self, memory: _Memory) -> Decoded:
        left = self.decode(memory, b"\n") if memory.rest.data else Decoded(memory)
        lacking = ["lacks a sentence of its message"] * len(left.memory.parts)
        return Decoded(self.start(), left.messages, (*left.refused, *lacking))

    def encode(self, report: TrackReport) -> bytes:
        lines = self._tll(report) if self.sentence == "TLL" else self._ttm(report)
        return "".join(f"${line}*{reduce(xor, line.encode('ascii'), 0):02X}\r\n" for line in lines).encode("ascii")

    def _tll(self, report: TrackReport) -> list[str]:
        if report.geodetic is None:
            raise ValueError("TLL needs latitudes and longitudes: the config must name an origin")
        latitude, longitude, _ = report.geodetic(report.mean)
        clock = _clock(report.time)
        return [
            f"{self.talker}TLL,{i % 1000:02d},{_angle(lat, 2, 'NS')},{_angle(lon, 3, 'EW')},,{clock},{_status(sure)},"
            for i, lat, lon, sure in zip(
                report.ids.tolist(), latitude.tolist(), longitude.tolist(), report.confirmed.tolist(), strict=True
            )
        ]

    def _ttm(self, report: TrackReport) -> list[str]:
        where = {axis.name: k for k, axis in enumerate(report.space.axes)}
        x, y = (report.mean[:, where[name]] for name in report.ground)
        moving = "vx" in where and "vy" in where
        vx, vy = (report.mean[:, where[f"v{name}"]] if moving else np.zeros(len(x)) for name in report.ground)
        bearing, course = (np.rad2deg(np.arctan2(e, n)) % 360.0 for e, n in ((x, y), (vx, vy)))
        columns = (report.ids, np.hypot(x, y) / 1852.0, bearing, np.hypot(vx, vy) / KNOT, course, report.confirmed)
        return [
            f"{self.talker}TTM,{i % 100:02d},{far:.2f},{angle:.1f},T,{speed:.1f},{over:.1f},T,,,N,,{_status(sure)},,"
            f"{_clock(report.time)},A"
            for i, far, angle, speed, over, sure in zip(*(column.tolist() for column in columns), strict=True)
        ]


def _status(sure: bool) -> str:
    """T: tracking; Q: not sure yet."""
    return "T" if sure else "Q"


def _clock(time: float) -> str:
    whole = time % 86400.0
    return f"{int(whole // 3600):02d}{int(whole % 3600 // 60):02d}{int(whole % 60 * 100) / 100:05.2f}"


def _angle(value: float, digits: int, letters: str) -> str:
    minutes = round(abs(value) * 600000.0)  # of 1e-4 minutes
    degrees, rest = divmod(minutes, 600000)
    return f"{degrees:0{digits}d}{rest / 10000:07.4f},{letters[value < 0]}"


def _time(tag: str) -> float | None:
    """Return the time in s that a TAG block states, which may stand before a sentence; ValueError if it is corrupted."""
    body, star, stated = tag.strip().strip("\\").partition("*")
    told = [part[2:] for part in body.split(",") if part.startswith("c:")]
    if not (tag.lstrip().startswith("\\") and told):
        return None
    right = star and tag.isascii() and f"{reduce(xor, body.encode(), 0):02X}" == stated[:2].upper()
    if not (right and told[0].isdecimal() and len(told[0]) <= 15):
        raise ValueError(f"wrong time or checksum of its TAG block: {shown(tag)}")
    return float(told[0]) / (1000.0 if float(told[0]) > MILLISECONDS else 1.0)


def _collected(memory: _Memory, line: bytes, *, tagged: bool) -> tuple[_Memory, list[_Sentence], list[str]]:
    """Return the memory, the sentences of a message that is whole now, and what is given up for it."""
    text = line.decode("ascii", errors="replace")
    start = text.find("!")
    if start < 0 and text.lstrip().startswith("$"):
        return memory, [], []
    sentence = text[start:].strip()
    body, star, stated = sentence[1:].partition("*")
    parts = body.split(",")
    if start < 0 or len(parts) != 7 or parts[0][2:] not in ("VDM", "VDO"):
        raise ValueError(f"is no AIS sentence: must be as !AIVDM,1,1,,A,...,0*5C, got {shown(text)}")
    if not star or not sentence.isascii() or f"{reduce(xor, body.encode(), 0):02X}" != stated[:2].upper():
        raise ValueError(f"wrong or no checksum: {shown(sentence)}")
    if not (parts[1].isdecimal() and parts[2].isdecimal() and 1 <= int(parts[2]) <= int(parts[1]) <= 9):
        raise ValueError(f"counts its sentences wrongly: {shown(sentence)}")
    total, place = int(parts[1]), int(parts[2])
    whole = sentence.encode(), _time(text[:start]) if tagged else None
    if total == 1:
        return memory, [whole], []
    key, held = (parts[4], parts[3], total), dict(memory.parts)
    known = dict(held.pop(key, ()))
    known[place] = whole
    if len(known) == total:
        return evolve(memory, parts=tuple(held.items())), [known[i] for i in sorted(known)], []
    held[key] = tuple(known.items())
    given_up = len(held) - HELD
    for old in list(held)[: max(given_up, 0)]:
        del held[old]
    told = ["lacks a sentence of its message"] * max(given_up, 0)
    return evolve(memory, parts=tuple(held.items())), [], told


def _position(sentences: list[bytes]) -> Message | None:
    """Return the position that a message holds; None for a message of another type; ValueError for none that is right."""
    pyais = needed("pyais", "AIS sentences need pyais", "live")
    try:
        decoded: Any = pyais.decode(*sentences)
    except Exception as error:  # whatever bits a sentence holds, pyais must not end the service
        raise ValueError(f"cannot be decoded: {error}") from None
    if decoded.msg_type not in POSITIONS:
        return None
    told = decoded.lat, decoded.lon, decoded.speed, decoded.course
    if any(value is None for value in told):
        raise ValueError("is cut short")
    latitude, longitude, speed, course = map(float, told)
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise ValueError("tells no position")
    moving = speed < 102.25 and course < 360.0
    row = [latitude, longitude, *((speed * KNOT, np.deg2rad(course)) if moving else ())]
    return Message("", None, np.array([row]), AXES[: len(row)], identity=np.array([code(str(decoded.mmsi))]))
