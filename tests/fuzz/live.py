"""Bytes of live formats in pieces, Parquet tables, and calls of a tracker in any order and with anything."""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from fuzz.cases import NUMBERS, pick
from fuzz.results import changed
from vedette import Detections, Scan
from vedette.streams import Format
from vedette.tracking import State, Tracker
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.source import CsvSource
from vedette_live.formats.asterix import Asterix
from vedette_live.formats.csv_lines import CsvLines
from vedette_live.formats.json_lines import JsonLines
from vedette_live.formats.nmea import Nmea

SENTENCES = (
    b"!AIVDM,1,1,,B,15M67FC000G?ufbE`FepT@3n00Sa,0*5C\r\n"
    b"!AIVDM,2,1,4,A,55O0W7`00001L@gCWGA2uItLth@DqtL5@F22220j1h742t0Ht0000000,0*08\r\n"
    b"!AIVDM,2,2,4,A,000000000000000,2*20\r\n"
    b"!AIVDM,1,1,,A,15NPOOPP00o?b=bE`UNv4?w428D;,0*24\r\n"
)
PLOTS = bytes.fromhex("30001df4191102708c400a000e0040001140a0001140a0001140a0001140")
FORMATS: list[tuple[Format, bytes]] = [
    (JsonLines(), JsonLines().sample()),
    (CsvLines(columns=("time", "sensor", "range", "bearing")), b"12.5,a,1.0,2.0\n13.5,a,,\n"),
    (Nmea(), SENTENCES),
    (Asterix(), PLOTS),
]
for first, good in FORMATS:  # imports what it needs: a package that is compiled first takes seconds, which are no case's
    first.decode(first.start(), good)
TRACKER = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01},
        "beacon": {"kind": "cartesian_position", "sigma": 5.0},
    },
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}


@cache
def tracker() -> Tracker:
    """Return the tracker that is called."""
    return vedette.build(TRACKER)


@cache
def _parquet() -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    target = io.BytesIO()
    parquet.write_table(pa.table({"t": np.arange(30.0), "x": np.arange(30.0) * 5, "y": np.zeros(30)}), target)
    return target.getvalue()


def _pieces(rng: np.random.Generator, folder: Path) -> str:
    form, good = pick(rng, FORMATS)
    data = changed(rng, good * int(rng.integers(1, 4)))
    memory, count, place = form.start(), 0, 0
    while place < len(data):
        size = int(rng.integers(1, 80))
        memory, messages, refused = _parts(form.decode(memory, data[place : place + size]))
        place, count = place + size, count + len(messages) + len(refused)
    _, messages, refused = _parts(form.end(memory))
    for text in refused:
        assert text, "refused without a word"
        assert len(text) < 5_000, f"{len(text)} characters"
    return "read" if count or messages else "nothing"


def _parts(decoded: Any) -> tuple[Any, Any, Any]:
    return decoded.memory, list(decoded.messages), list(decoded.refused)


def _table(rng: np.random.Generator, folder: Path) -> str:
    path = folder / "a.parquet"
    path.write_bytes(changed(rng, _parquet()))
    columns = DetectionColumns(sensor="beacon", time="t", columns={"x": "x", "y": "y"})
    CsvSource(columns, str(path)).open(tracker().sensors, rng)
    return "read"


def _times(rng: np.random.Generator, now: float) -> Any:
    return pick(rng, [now, now + 1.0, now + 1.0, now + 1.0, now - 5.0, now + 1e9, np.nan, np.inf, *NUMBERS])


def _scan(rng: np.random.Generator, now: float) -> Scan:
    sensor = pick(rng, ["radar", "beacon", "beacon", "sonar", ""])
    z = rng.normal(100.0, 50.0, (int(rng.integers(0, 4)), pick(rng, [2, 2, 2, 2, 1, 3])))
    if rng.random() < 0.2 and z.size:
        z.flat[int(rng.integers(z.size))] = float(pick(rng, [np.nan, np.inf, 1e308, -1e308, 0.0]))
    return Scan(_times(rng, now), sensor, Detections.of(z, 2))


def _calls(rng: np.random.Generator, folder: Path) -> str:
    """Start, step, predict and estimate in some order, with states of before and of the wrong sort, too."""
    known: list[State] = [tracker().start(seed=1)]
    refused = 0
    for _ in range(int(rng.integers(3, 20))):
        state: Any = known[-1] if rng.random() < 0.9 else pick(rng, [*known, None, 3, "state"])
        now = state.time if isinstance(state, State) and np.isfinite(state.time) else 0.0
        try:
            how = rng.random()
            if how < 0.7:
                known.append(tracker().step(state, _scan(rng, now)))
            elif how < 0.8:
                tracker().estimate(state, pick(rng, [None, _times(rng, now)]))
            elif how < 0.9:
                known.append(tracker().state_from(state.to_data() if isinstance(state, State) else state))
            else:
                tracker().predict(state, _times(rng, now))
        except (vedette.VedetteError, ValueError, TypeError) as error:
            refused += 1
            _check_told(error)
        mean = tracker().estimate(known[-1]).mean
        assert np.all(np.isfinite(mean)), "a state is not finite"
    return "refused" if refused else "taken"


def _check_told(error: Exception) -> None:
    told = f"{type(error).__name__}: {error}"
    assert str(error), f"{told}: an error without a word"
    assert isinstance(error, vedette.VedetteError) or _ours(error), told


def _ours(error: Exception) -> bool:
    """Return whether an error is raised by Vedette's own hand, and not by numpy within it."""
    last = error.__traceback__
    while last is not None and last.tb_next is not None:
        last = last.tb_next
    return last is None or "vedette" in last.tb_frame.f_code.co_filename or "fuzz" in last.tb_frame.f_code.co_filename


def case(rng: np.random.Generator, folder: Path) -> str:
    """Draw one of these."""
    return pick(rng, [_pieces, _pieces, _table, _calls])(rng, folder)
