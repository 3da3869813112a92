"""Tracks to CSV for spreadsheets and plotting, and to JSON lines that read back to the last bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, Indices, InputError, Space, Track
from vedette_files.georeference import PLAIN, Terms
from vedette_files.input_files import lines, shown
from vedette_files.json_values import number, parse, short
from vedette_files.jsonl.recording import space_of
from vedette_files.jsonl.scans import identity_code
from vedette_files.tracks.lines import FORMAT, VERSION, chunks, csv_head, jsonl_head
from vedette_files.tracks.rows import EXTRA, TrackRows
from vedette_files.writing import whole_file


def write_tracks_csv(path: Path | str, tracks: Sequence[Track], space: Space, terms: Terms = PLAIN) -> None:
    """Write one row per track and scan, tracks as given; docs/formats.md lists the columns. Equal tracks give equal bytes.

    `space` is the state space of all tracks; the header needs it if there are none. A number that is not finite is an
    empty cell. `terms` add columns. ValueError, and no file, for a track over another space or with other modes than the
    first.
    """
    rows = TrackRows.of(tracks, space)
    with whole_file(Path(path)) as file:
        file.write(csv_head(space, rows.modes.shape[1], terms, rows.extra))
        file.writelines(chunk.csv(terms) for chunk in chunks(rows))


def write_tracks_jsonl(path: Path | str, tracks: Sequence[Track], space: Space) -> None:
    """Write the complete tracks, one line per track and scan, as `read_tracks` reads it. Equal tracks give equal bytes.

    A number that is not finite is null. ValueError, and no file, as in `write_tracks_csv`.
    """
    rows = TrackRows.of(tracks, space)
    with whole_file(Path(path)) as file:
        file.write(jsonl_head(space))
        file.writelines(chunk.jsonl() for chunk in chunks(rows))


def read_tracks(path: Path | str) -> tuple[Track, ...]:
    """Read the tracks that `write_tracks_jsonl` wrote, in its order, null as NaN. InputError names the first bad line."""
    given = lines(Path(path))
    space = None
    told: dict[int, list[dict[str, Any]]] = {}
    merged: dict[int, tuple[float, int]] = {}
    for place, text in given:
        if not text.strip():
            continue
        try:
            if space is None:
                space = _header(parse(text))
                continue
            given_line = parse(text)
            if isinstance(given_line, dict) and "merged_into" in given_line:
                track, end = _end(given_line, told)
                merged[track] = end
                continue
            fields = _fields(given_line, len(space))
            track = fields.pop("track")
            merged.pop(track, None)
            _append(told.setdefault(track, []), fields)
        except ValueError as error:
            raise InputError(f"{path}:{place}: {error}") from None
    if space is None:
        raise InputError(f"{path}: is empty")
    return tuple(_track(identity, space, rows, merged.get(identity)) for identity, rows in told.items())


def _append(rows: list[dict[str, Any]], fields: dict[str, Any]) -> None:
    """Add a line to those of its track; ValueError if it does not go with them."""
    if rows and np.shape(rows[0]["mode_prob"]) != np.shape(fields["mode_prob"]):
        raise ValueError("mode_prob must have as many modes as in the lines before")
    for name in (*EXTRA, "identity"):
        if rows and (rows[0][name] is None) != (fields[name] is None):
            raise ValueError(f"{name} must be in all lines of a track or in none")
    if rows and fields["parents"]:
        raise ValueError("parents must be in the first line of their track")
    rows.append(fields)


def _end(given: dict[str, Any], told: dict[int, Any]) -> tuple[int, tuple[float, int]]:
    """Return which track merged, when and into which, of a line that says so; ValueError if it does not."""
    track, other = given.get("track"), given["merged_into"]
    if set(given) != {"track", "time", "merged_into"} or type(track) is not int or type(other) is not int:
        raise ValueError(f"must have track and merged_into, whole numbers, and time alone, got {short(given)}")
    if track not in told:
        raise ValueError(f"track {track} must have a line before the one that ends it")
    return track, (number(given["time"], "time"), other)


def _header(given: Any) -> Space:
    if not isinstance(given, dict) or (given.get("format"), given.get("version")) != (FORMAT, VERSION):
        expected = f'{{"format": "{FORMAT}", "version": {VERSION}, ...}}'
        raise ValueError(f"the first line must be a header {expected}, got {short(given)}")
    return space_of(given.get("axes"), "axes")


def _fields(given: Any, n: int) -> dict[str, Any]:
    """Return one line's values as arrays; ValueError if it is not a line of a tracks file over n axes."""
    if not isinstance(given, dict):
        raise ValueError(f"must be an object, got {short(given)}")
    if type(given.get("track")) is not int or type(given.get("confirmed")) is not bool:
        raise ValueError(f"track must be a whole number, and confirmed true or false, got {short(given)}")
    shapes = {
        "mean": (n,),
        "cov": (n, n),
        "existence": (),
        "hit": (),
        "nis": (),
        "weights": (None,),
        "mode_prob": (None,),
        "returns": (None,),
        **dict.fromkeys(EXTRA, ()),
    }
    fields = {"track": given["track"], "confirmed": given["confirmed"], "times": number(given.get("time"), "time")}
    known = ("track", "time", "confirmed", *shapes, "parents", "identity")
    for name in given:
        if name not in known:
            raise ValueError(f"unknown field {shown(name)}; known are {', '.join(known)}")
    for name, shape in shapes.items():
        absent = name in ("mode_prob", "returns", *EXTRA) and name not in given
        fields[name] = None if absent else _array(given.get(name), shape, name)
    fields["identity"] = identity_code(given["identity"]) if "identity" in given else None
    fields["parents"] = given.get("parents", [])
    if not isinstance(fields["parents"], list) or any(type(one) is not int for one in fields["parents"]):
        raise ValueError(f"parents must be a list of whole numbers, got {short(fields['parents'])}")
    return fields


def _array(value: Any, shape: tuple[int | None, ...], what: str) -> Array:
    try:
        numbers = np.array(_numbers(value), dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{what} must be numbers or null, got {short(value)}") from None
    if len(shape) != numbers.ndim or any(want not in (None, got) for want, got in zip(shape, numbers.shape, strict=True)):
        wanted = "(any,)" if None in shape else str(shape)
        raise ValueError(f"{what} must have shape {wanted}, got {short(value)}")
    return numbers


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(item) for item in value]
    if isinstance(value, bool | str | dict):
        raise TypeError
    return np.nan if value is None else value


def _track(identity: int, space: Space, rows: list[dict[str, Any]], merged: tuple[float, int] | None) -> Track:
    ragged = ("weights", "returns", "parents")
    columns: dict[str, Any] = {
        name: None if first is None else np.array([row[name] for row in rows])
        for name, first in rows[0].items()
        if name not in ragged
    }
    return Track(
        id=identity,
        space=space,
        weights=tuple(row["weights"] for row in rows),
        returns=_returns([row["returns"] for row in rows]),
        parents=tuple(rows[0]["parents"]),
        merged=merged,
        **columns,
    )


def _returns(rows: list[Array | None]) -> tuple[Indices | None, ...] | None:
    whole = [None if row is None else row.astype(np.int64) for row in rows]
    return tuple(whole) if any(row is not None for row in whole) else None
