"""Tables as others write them: dates, latitudes, Parquet, data frames; read as told, or drafted and run."""

from __future__ import annotations

import io
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

import vedette
from fuzz.cases import pick
from fuzz.inputs import CELLS, spoilt
from fuzz.readers import RADAR, check_rows, count, opened
from vedette_files import CsvSource
from vedette_files.tables.returns import DetectionColumns

Rng = np.random.Generator
Table = dict[str, list[object]]
ROWS = 40
ZONES = ["", "Z", "+02:00", "-0330", " UTC"]


def dated(rng: Rng) -> Table:
    """Return plots with ISO stamps, latitudes and longitudes."""
    zone = pick(rng, ZONES)
    stamps: list[object] = [f"2026-03-0{1 + i // 24}T{i % 24:02d}:59:{i:02d}.5{zone}" for i in range(ROWS)]
    return {
        "Timestamp": stamps,
        "Lat [deg]": [60.0 + 1e-3 * i for i in range(ROWS)],
        "Lon [deg]": [pick(rng, [5.0, 179.999, -180.0]) + 1e-3 * i for i in range(ROWS)],
        "Alt [m]": [10.0] * ROWS,
    }


def polar(rng: Rng) -> Table:
    """Return a radar's plots by time of day, in NM and degrees, on a ship under way."""
    return {
        "time": [f"23:{50 + i // 6}:{10 * (i % 6):02d}" if i < 60 else f"00:00:{i - 60}" for i in range(ROWS)],
        "range_nm": [2.0 + 0.01 * i for i in range(ROWS)],
        "bearing_deg": [(350.0 + i) % 360 for i in range(ROWS)],
        "own_x_m": [5.0 * i for i in range(ROWS)],
        "own_y_m": [0.0] * ROWS,
        "heading_deg": [90.0] * ROWS,
    }


def counted(rng: Rng) -> Table:
    """Return plots by shuffled milliseconds, with a name and a speed."""
    order = rng.permutation(ROWS).tolist()
    return {
        "t_ms": [1_700_000_000_000 + 1000 * i for i in order],
        "x": [10.0 * i for i in order],
        "y": [-5.0 * i for i in order],
        "vr": [10.0] * ROWS,
        "id": ["a"] * ROWS,
    }


def as_csv(table: Table) -> bytes:
    """Return the bytes of a CSV file."""
    rows = [",".join(map(str, row)) for row in zip(*table.values(), strict=True)]
    return "\n".join([",".join(table), *rows, ""]).encode(errors="surrogatepass")


def changed(rng: Rng, table: Table) -> Table:
    """Return a table with some odd cells, all of a column if need be."""
    found = {title: list(cells) for title, cells in table.items()}
    for _ in range(int(rng.integers(0, 3))):
        column = found[pick(rng, list(found))]
        odd: object = pick(rng, [*CELLS[:-3], None, "", float("nan"), float("inf"), 10**12, -1])
        if rng.random() < 0.1:
            column[:] = [odd] * len(column)
        else:
            column[int(rng.integers(len(column)))] = odd
    return found


def read_dates(rng: Rng, folder: Path) -> None:
    """Read dates and latitudes as told."""
    data = spoilt(rng, as_csv(dated(rng)))
    (folder / "d.csv").write_bytes(data)
    columns = {"latitude": "Lat [deg]", "longitude": "Lon [deg]"}
    source = CsvSource(
        DetectionColumns(time="Timestamp", columns=columns), str(folder / "d.csv"), sort=bool(rng.random() < 0.5)
    )
    opened(source, RADAR, {"detections": count(data)})


def read_parquet(rng: Rng, folder: Path) -> None:
    """Read a Parquet file: with odd cells, or with odd bytes."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    table, file = counted(rng), io.BytesIO()
    odd = changed(rng, table) if rng.random() < 0.7 else table
    plain = {title: cells if cells == table[title] else list(map(_text, cells)) for title, cells in odd.items()}
    parquet.write_table(pa.table(plain), file)
    data = file.getvalue()
    if odd is table:
        at = rng.integers(len(data), size=3)
        data = bytes(b ^ 1 << int(rng.integers(8)) if i in at else b for i, b in enumerate(data))
    (folder / "d.parquet").write_bytes(data)
    source = CsvSource(
        DetectionColumns(time="t_ms", columns={"x": "x", "y": "y"}, units={"time": "ms"}), str(folder / "d.parquet")
    )
    opened(source, RADAR, {} if odd is table else {"detections": ROWS})


def read_frame(rng: Rng, folder: Path) -> None:
    """Track the targets of a data frame, drafted or as told."""
    import pandas as pd

    columns = changed(rng, pick(rng, [dated, polar, counted])(rng))
    try:
        frame = pd.DataFrame(columns)
    except UnicodeEncodeError:  # half a character, for which pandas' own strings have no place
        frame = pd.DataFrame(columns, dtype=object)
    result = _tracked(frame)
    check_rows(result.recording.rows, {"detections": len(frame)})


def draft(rng: Rng, folder: Path) -> None:
    """Draft a config for a file, and run it."""
    data = spoilt(rng, as_csv(changed(rng, pick(rng, [dated, polar, counted])(rng))))
    path = folder / "plots.csv"
    path.write_bytes(data)
    result = _tracked(path)
    check_rows(result.recording.rows, {"detections": count(data)})


def _tracked(data: object) -> vedette.Result:
    """Return what a draft gives that may not fit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return vedette.track(data)


def _text(cell: object) -> str | None:
    return None if cell is None else str(cell).encode(errors="replace").decode()


READERS: dict[str, Callable[[Rng, Path], None]] = {
    "dates": read_dates,
    "parquet": read_parquet,
    "frame": read_frame,
    "draft": draft,
}


def case(rng: Rng, folder: Path) -> str:
    """Write one table with changes, and read it."""
    here = folder / "table"
    shutil.rmtree(here, ignore_errors=True)
    here.mkdir(parents=True)
    name = pick(rng, list(READERS))
    READERS[name](rng, here)
    return f"accepted by {name}"
