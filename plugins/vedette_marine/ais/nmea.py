"""AIS reports from NMEA 0183 sentences, decoded by pyais."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Problem, Rows
from vedette.fields import ABSURD
from vedette_files.input_files import lines, shown
from vedette_files.libraries import needed
from vedette_marine.ais.reports import KNOT, Reports, by_ship, rate_of_turn, turn_rate

POSITIONS = (1, 2, 3, 18, 19, 27)
"""Message types that hold a ship's position: class A, class B, long range."""


def checksum(sentence: str) -> int | None:
    """Return the exclusive or of the characters between the mark and the star; None if there is no star."""
    body, star, _ = sentence[1:].partition("*")
    return reduce(xor, body.encode("ascii", "replace"), 0) if star else None


def checked(sentence: str) -> str:
    """Return the sentence from its mark on; ValueError if it is not an AIS sentence or its checksum is wrong."""
    start = sentence.find("!")
    if start < 0 or not sentence[start + 3 :].startswith(("VDM", "VDO")):
        raise ValueError(f"is no AIS sentence: must be as !AIVDM,1,1,,A,...,0*5C, got {shown(sentence)}")
    whole = sentence[start:].strip()
    if not (whole.isascii() and whole.isprintable()):
        raise ValueError(f"holds characters that no sentence has: {shown(whole)}")
    stated, computed = whole.rpartition("*")[2][:2], checksum(whole)
    if computed is None:
        raise ValueError("ends without a checksum: it is cut off")
    try:
        right = int(stated, 16) == computed
    except ValueError:
        right = False
    if not right:
        raise ValueError(f"wrong checksum: the sentence says {stated!r}, its characters give {computed:02X}")
    return whole


def messages(sentences: Iterable[tuple[str, str]], refused: list[Problem]) -> Iterator[tuple[str, Any, int]]:
    """Yield the place of a message, the message, and of how many sentences it is; add what cannot be used to `refused`.

    The parts of a long message need not be adjacent: they are joined by their number and channel.
    """
    pyais = needed("pyais", "AIS sentences need pyais", "marine")
    waiting: dict[tuple[str, str, str], tuple[str, list[str]]] = {}
    for place, sentence in sentences:
        parts = [sentence]
        try:
            whole = checked(sentence)
            fields = whole.split(",")
            if len(fields) != 7 or not fields[1].isdigit() or not fields[2].isdigit():
                raise ValueError(f"must have 7 fields, of which the second and third are numbers, got {shown(whole)}")
            if not fields[5]:
                raise ValueError("is empty: it holds no message")
            parts = [whole]
            if fields[1] != "1":
                key = (fields[1], fields[3], fields[4])
                if fields[2] == "1":
                    if key in waiting:
                        refused.append(_lacking(*waiting.pop(key)))
                    waiting[key] = (place, [])
                elif key not in waiting or len(waiting[key][1]) != int(fields[2]) - 1:
                    raise ValueError(f"is part {fields[2]} of {fields[1]} without those before it")
                waiting[key][1].append(whole)
                if len(waiting[key][1]) < int(fields[1]):
                    continue
                place, parts = waiting.pop(key)
            yield place, pyais.decode(*(part.encode() for part in parts)), len(parts)
        except ValueError as error:
            refused.append(Problem(place, str(error), len(parts)))
        except Exception as error:  # pyais raises its own errors, and passes on those of its libraries for odd payloads
            refused.append(Problem(place, f"cannot be decoded: {type(error).__name__}: {error}", len(parts)))
    refused.extend(_lacking(place, parts) for place, parts in waiting.values())


def _lacking(place: str, parts: list[str]) -> Problem:
    return Problem(place, "is the first part of a message whose other parts are missing", len(parts))


def read_nmea(path: Path, interval: float = 0.0) -> tuple[dict[int, Reports], list[Problem], Rows]:
    """Read position reports by MMSI from a file of sentences, the sentences that could not be used, and an account of all.

    Left out are the sentences of messages without a position, such as a ship's name.

    A line may begin with its time in s and a space; otherwise line i has the time i `interval`, as sentences hold no time. A
    course, speed, heading or rate of turn that is "not available" is NaN; a report without a position is listed as unusable.
    """
    refused: list[Problem] = []
    times: dict[str, float] = {}
    total = 0

    def stamped() -> Iterator[tuple[str, str]]:
        nonlocal total
        for number, line in lines(path):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            total += 1
            place = f"{path.name}:{number}"
            head = line[: max(line.find("!"), 0)].strip()
            try:
                times[place] = float(head) if head else (number - 1) * interval
                if not abs(times[place]) <= ABSURD:  # also for NaN
                    raise ValueError
            except ValueError:
                refused.append(Problem(place, f"must begin with a time in s or with the sentence, got {shown(head)}"))
                continue
            yield place, line

    rows, used, left_out = [], 0, 0
    for place, message, parts in messages(stamped(), refused):
        if message.msg_type not in POSITIONS:
            left_out += parts
            continue
        row = row_of(message, times[place])
        if row is None:
            refused.append(Problem(place, f"MMSI {message.mmsi} reports no position", parts))
        else:
            rows.append(row)
            used += parts
    return by_ship(rows), refused, Rows(total, used, sum(problem.rows for problem in refused), left_out)


def row_of(message: Any, time: float) -> dict[str, float] | None:
    """Return a decoded position report as `by_ship` takes it; None without a position (latitude 91, longitude 181)."""
    latitude, longitude = _value(message, "lat"), _value(message, "lon")
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        return None
    course = _value(message, "course")
    speed, heading = _value(message, "speed"), _value(message, "heading")
    fastest = 63.0 if message.msg_type == 27 else 102.25
    return {
        "mmsi": float(int(message.mmsi)),
        "time": time,
        "latitude": latitude,
        "longitude": longitude,
        "speed": speed * KNOT if speed < fastest else np.nan,
        "course": np.deg2rad(course) if course < 360 else np.nan,
        "heading": np.deg2rad(heading) if heading < 360 else np.nan,
        "turn": float(turn_rate(np.array(_rot(message)))),
    }


def _value(message: Any, name: str) -> float:
    value = getattr(message, name, None)
    return np.nan if value is None else float(value)


def _rot(message: Any) -> float:
    """Return the rate of turn as it was sent: pyais gives deg/min, and the codes +-127 and -128 as they are."""
    value = getattr(message, "turn", None)
    if value is None:
        return np.nan
    number = float(value.value if hasattr(value, "value") else value)
    if abs(number) >= 127 and hasattr(value, "value"):
        return number
    return float(rate_of_turn(np.array(number)))
