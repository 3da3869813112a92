"""Drafts of data from the wild: `python -m benchmarks.wild [NAME ...] [--seed 1]`, a line for each file.

Each file is drafted as `vedette new config` does and run, two commands, nothing edited. Where its names are hidden, they
are the truth that tracks are judged by; where they are an aid, as they are or a twentieth wrong, the names as they were
judge. Recordings come from the folder in VEDETTE_DATA; the others are drawn anew by `--seed`. Of AIS a tenth of the
reports is held back, from draft and run alike: a report is covered if a track is within 200 m of it.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import vedette
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.wishes import Wishes

Row = dict[str, Any]

WRONG, HELD = 0.05, 0.1
"""The part of codes that are wrong, and of reports that are held back."""

OFTEN = 5
"""A ship of so many reports is to have a track."""

CUT_OFF, NEAR = 50.0, 200.0
"""m: of aircraft and all others, and of ships."""

TURN = 4.0
"""s: of the antenna."""


def recorded(*parts: str) -> list[Row]:
    """Return the rows of a recording."""
    with Path(os.environ["VEDETTE_DATA"]).joinpath(*parts).open(newline="") as file:
        return list(csv.DictReader(file))


def table(path: Path, rows: Iterable[Row]) -> Path:
    """Write rows as CSV."""
    rows = list(rows)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return path


def told(path: Path, use: str, judge: str = "", wishes: Wishes | None = None, cut_off: float = CUT_OFF) -> Row:
    """Return what a draft and its run come to; `judge`: the column of true names, if they are not `use`d as truth."""
    begun = time.process_time()
    draft = drafted(path, use, wishes or Wishes())
    cpu = time.process_time() - begun
    config = tomllib.loads(draft.text)
    if judge:
        read = config["source"]["detections"]
        true = {name: read[name] for name in ("time", "columns", "units") if name in read}
        config["source"]["truth"] = true | {"file": path.name, "object": judge}
    result = vedette.load(config | {"judge": {"cover_radius": cut_off, "gospa_cutoff": cut_off}}).run()
    score = result.score()
    figures = {
        "objects": len(result.recording.truth), "tracks": score.tracks, "switches": score.id_switches,
        "covered": _short(score.coverage), "HOTA": _short(score.hota), "RMSE": _short(score.position_rmse_m),
    }  # fmt: skip
    known = {name: value for name, value in figures.items() if value is not None}
    return {"exit": 3 if draft.failure else 0, **known, "cpu": round(cpu, 1), "failure": draft.failure}


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.3g}")


def aircraft(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from the sky over Switzerland: names hidden, known, and a twentieth wrong by each of four ways."""
    rows = [row | {"real": row["icao24"]} for row in recorded("adsb", "area_20min.csv")]
    path = table(folder / "sky.csv", rows)
    yield "hidden", told(path, "truth")
    yield "named", told(path, "aid", "real")
    for way in (exchanged, blanked, shared, one_of_two):
        yield f"5 % {way.__name__}", told(table(folder / f"{way.__name__}.csv", way(rows, seed)), "aid", "real")


def exchanged(rows: Sequence[Row], seed: int) -> list[Row]:
    """Return rows of which a twentieth bears the name of another of its time, which bears its."""
    rng, rows = np.random.default_rng([seed, 1]), [dict(row) for row in rows]
    at = _by_time(rows)
    for i in rng.permutation(len(rows))[: round(WRONG * len(rows) / 2)]:
        if others := [j for j in at[rows[i]["time_utc"]] if j != i]:
            j = int(rng.choice(others))
            rows[i]["icao24"], rows[j]["icao24"] = rows[j]["icao24"], rows[i]["icao24"]
    return rows


def blanked(rows: Sequence[Row], seed: int) -> list[Row]:
    """Return rows of which a twentieth bears no name."""
    rng = np.random.default_rng([seed, 2])
    return [row | ({"icao24": ""} if rng.random() < WRONG else {}) for row in rows]


def shared(rows: Sequence[Row], seed: int) -> list[Row]:
    """Return rows of which a twentieth bears the name of any of its time."""
    rng, at = np.random.default_rng([seed, 3]), _by_time(rows)

    def another(row: Row) -> str:
        return str(rows[int(rng.choice(at[row["time_utc"]]))]["icao24"])

    return [row | ({"icao24": another(row)} if rng.random() < WRONG else {}) for row in rows]


def one_of_two(rows: Sequence[Row], seed: int) -> list[Row]:
    """Return rows in which two aircraft bear one name all the time: of 25, that is a twentieth too."""
    rng = np.random.default_rng([seed, 4])
    first, second = rng.choice(sorted({row["icao24"] for row in rows}), 2, replace=False)
    return [row | ({"icao24": str(first)} if row["icao24"] == second else {}) for row in rows]


def _by_time(rows: Sequence[Row]) -> dict[str, list[int]]:
    at: dict[str, list[int]] = {}
    for i, row in enumerate(rows):
        at.setdefault(row["time_utc"], []).append(i)
    return at


def circling(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from one aircraft that circles, its positions smoothed already."""
    path = table(folder / "one.csv", recorded("adsb", "one_aircraft.csv"))
    yield "", told(path, "truth")


def ships(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from the Solent: its first 800 rows and all 84 minutes; the reports that are held back are a tenth of all."""
    rows = recorded("solent_ais", "SolentAIS_20160112_130211.csv")
    for name, some in (("800 rows", rows[:800]), ("84 minutes", rows)):
        for use in ("aid", "ignore"):
            yield f"{name}, {use}", _ships(folder / "ais.csv", some, use, seed)


def noaa(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from twelve of these ships as NOAA prints AIS, names an aid and ignored."""
    rows = recorded("solent_ais", "SolentAIS_20160112_130211.csv")
    often = [name for name, count in Counter(row["MMSI"] for row in rows).most_common() if count > 30]
    some = set(np.random.default_rng([seed, 5]).choice(sorted(often), 12, replace=False).tolist())
    printed = [
        {
            "MMSI": row["MMSI"], "BaseDateTime": row["Time"][:19].replace(" ", "T"), "LAT": f"{float(row[LATITUDE]):.5f}",
            "LON": f"{float(row[LONGITUDE]):.5f}", "SOG": row["SOG_knots"], "COG": row["COG_degrees"], "Heading": "511.0",
            "VesselName": f"SHIP {row['MMSI'][-3:]}", "IMO": "", "CallSign": "", "VesselType": "70", "Status": "0",
            "Length": "80", "Width": "12", "Draft": "", "Cargo": "70", "TransceiverClass": "A",
        }
        for row in rows
        if row["MMSI"] in some
    ]  # fmt: skip
    for use in ("aid", "ignore"):
        yield use, _ships(folder / "noaa.csv", printed, use, seed, "BaseDateTime", ("LAT", "LON"))


LATITUDE, LONGITUDE = "Latitude_degrees", "Longitude_degrees"


def _ships(
    path: Path, rows: Sequence[Row], use: str, seed: int, when: str = "Time", where: tuple[str, str] = (LATITUDE, LONGITUDE)
) -> Row:
    """Return what a draft without the reports that are held back comes to at these."""
    rng = np.random.default_rng([seed, 6])
    often = {name for name, count in Counter(row["MMSI"] for row in rows).items() if count >= OFTEN}
    held = {i for i, row in enumerate(rows) if rng.random() < HELD and row["MMSI"] in often}
    table(path, (row for i, row in enumerate(rows) if i not in held))
    begun = time.process_time()
    draft = drafted(path, use)
    cpu = time.process_time() - begun
    result = vedette.load(tomllib.loads(draft.text)).run()
    tracks = result.tracks
    covered = Counter(rows[i]["MMSI"] for i in held if _apart(result, rows[i], when, where) <= NEAR)
    looks = Counter(rows[i]["MMSI"] for i in held)
    figures: Row = {"exit": 3 if draft.failure else 0, "ships": len(often), "tracks": len(tracks)}
    if use == "aid":
        borne = [set(track.identity[track.identity >= 0].tolist()) for track in tracks]
        bear = Counter(name for names in borne for name in names)
        kept = {
            name for name, count in Counter(r["MMSI"] for i, r in enumerate(rows) if i not in held).items() if count >= OFTEN
        }
        figures |= {"with one track": sum(bear[int(name)] == 1 for name in kept), "of": len(kept)}
        figures |= {"tracks of two names": sum(len(names) > 1 for names in borne)}
    return figures | {
        "held reports covered": _short(sum(covered.values()) / len(held)),
        "ships covered": _short(sum(covered[name] >= 0.5 * count for name, count in looks.items()) / len(looks)),
        "cpu": round(cpu, 1), "failure": draft.failure,
    }  # fmt: skip


def _apart(result: vedette.Result, row: Row, when: str, where: tuple[str, str]) -> float:
    """Return how far, in m, a report lies from the nearest track."""
    from datetime import UTC, datetime

    moment = datetime.fromisoformat(row[when]).replace(tzinfo=UTC).timestamp()
    latitude, longitude, *_ = (float(part) for part in result.recording.notes["origin"].split(","))
    north, east = (float(row[where[0]]) - latitude), (float(row[where[1]]) - longitude)
    spot = 111_195.0 * np.array([north, east * np.cos(np.radians(latitude))])
    apart = [
        np.hypot(*(spot - [np.interp(moment, track.times, track.mean[:, track.space.names.index(axis)]) for axis in "xy"]))
        for track in result.tracks
        if track.times[0] <= moment <= track.times[-1]
    ]
    return float(min(apart, default=np.inf))


def drone(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from a drone's GPS, in degrees: it hovers, and flies at 15 m/s, by turns of 20 s."""
    rng, spot, pace, rows = np.random.default_rng([seed, 7]), np.zeros(2), np.zeros(2), []
    for i in range(600):
        course = 2.0 * (i // 100)
        wanted = 15.0 * np.array([np.cos(course), np.sin(course)]) * (i // 100 % 2)
        pace = pace + np.clip(wanted - pace, -0.8, 0.8)
        spot = spot + 0.2 * pace
        north, east = (spot + rng.normal(0, 0.5, 2)) / 111_195.0
        rows.append(
            {
                "time": f"{0.2 * i:.1f}",
                "lat": f"{47 + north:.7f}",
                "lon": f"{8 + east / np.cos(np.radians(47)):.7f}",
                "id": 1,
            }
        )
    yield "", told(table(folder / "drone.csv", rows), "truth")


def circle(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from a circle of 300 m at 7.5 m/s."""
    rng = np.random.default_rng([seed, 8])
    spots = [300 * np.array([np.cos(i / 40), np.sin(i / 40)]) + rng.normal(0, 2, 2) for i in range(300)]
    rows = [{"time": i, "x": f"{x:.2f}", "y": f"{y:.2f}", "id": 1} for i, (x, y) in enumerate(spots)]
    yield "", told(table(folder / "circle.csv", rows), "truth")


def turning(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from plots of an antenna that turns in 4 s, with times of their own: errors of 40 m and .1 deg, few false."""
    rng, rows = np.random.default_rng([seed, 9]), []
    start, pace = rng.uniform(-20_000, 20_000, (12, 2)), rng.normal(0, 80, (12, 2))
    for turn in range(60):
        plots = [(start[i] + pace[i] * (turn + 0.5) * TURN, i) for i in range(12) if rng.random() < 0.9]
        for spot, i in plots:
            at = TURN * (turn + (np.arctan2(spot[1], spot[0]) % (2 * np.pi)) / (2 * np.pi))
            spot = start[i] + pace[i] * at
            seen = (np.hypot(*spot) + rng.normal(0, 40), np.degrees(np.arctan2(spot[1], spot[0])) + rng.normal(0, 0.1))
            rows.append((at, turn, *seen, i, *spot))
        for _ in range(rng.poisson(1.0)):
            bearing = rng.uniform(0, 360)
            rows.append((TURN * (turn + bearing / 360), turn, rng.uniform(1e3, 25e3), bearing, "", "", ""))
    cells = [
        {"time": f"{t:.3f}", "turn": turn, "range": f"{r:.1f}", "azimuth": f"{b % 360:.3f}", "target": i, "tx": tx, "ty": ty}
        for t, turn, r, b, i, tx, ty in sorted(rows, key=lambda row: row[0])
    ]
    true = [
        {"time": f"{t:.1f}", "target": i, "x": start[i][0] + pace[i][0] * t, "y": start[i][1] + pace[i][1] * t}
        for t in np.arange(0, 60 * TURN, TURN / 2)
        for i in range(12)
    ]
    table(folder / "true.csv", true)
    for scan in ("", "turn"):
        path = table(
            folder / "turns.csv",
            ({k: v for k, v in row.items() if k in ("time", "turn", "range", "azimuth")} for row in cells),
        )
        yield scan or "found", _beside(path, Wishes(scan=scan), "true.csv", "target", 300.0)


def _beside(path: Path, wishes: Wishes, file: str, name: str, cut_off: float) -> Row:
    """Return what a draft comes to by a truth in another file, of which it does not know."""
    begun = time.process_time()
    draft = drafted(path, wishes=wishes)
    cpu = time.process_time() - begun
    config = tomllib.loads(draft.text)
    source = config["source"]
    source |= {
        "path": str(path.parent),
        "truth": {"file": file, "time": "time", "columns": {"x": "x", "y": "y"}, "object": name},
    }
    source["detections"]["file"] = path.name
    result = vedette.load(config | {"judge": {"cover_radius": cut_off, "gospa_cutoff": cut_off}}).run()
    score = result.score()
    return {
        "exit": 3 if draft.failure else 0, "objects": len(result.recording.truth), "tracks": score.tracks,
        "switches": score.id_switches, "covered": _short(score.coverage), "HOTA": _short(score.hota),
        "RMSE": _short(score.position_rmse_m), "false tracks": _short(score.false_tracks),
        "refused": result.intake.refused.count, "cpu": round(cpu, 1), "failure": draft.failure,
    }  # fmt: skip


def cars(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from cars seen by lidars ten times a second: errors of .09 and .16 m, correlated from scan to scan."""
    for error, rho in ((0.09, 0.63), (0.16, 0.74)):
        rng, rows, true = np.random.default_rng([seed, 10]), [], []
        start, pace = rng.uniform(-60, 60, (4, 2)), rng.normal(0, 8, (4, 2))
        off = rng.normal(0, error, (4, 2))
        for k in range(600):
            off = rho * off + rng.normal(0, error * np.sqrt(1 - rho**2), (4, 2))
            for i in range(4):
                x, y = start[i] + pace[i] * 0.1 * k
                true.append({"time": f"{0.1 * k:.1f}", "car": i, "x": x, "y": y})
                rows.append({"time": f"{0.1 * k:.1f}", "x": f"{x + off[i, 0]:.3f}", "y": f"{y + off[i, 1]:.3f}"})
        table(folder / "true.csv", true)
        yield f"{error} m, {rho}", _beside(table(folder / "cars.csv", rows), Wishes(), "true.csv", "car", 2.0)


def pictures(folder: Path, seed: int) -> Iterator[tuple[str, Row]]:
    """Draft from pixels with the number of a frame, MOT, JSON lines, and a lidar's clusters in space."""
    rng, count = np.random.default_rng([seed, 11]), 8
    start, pace = rng.uniform(100, 900, (count, 2)), rng.normal(0, 40, (count, 2))
    every = [(k, i, *(start[i] + pace[i] * k / 30 + rng.normal(0, 1, 2))) for k in range(1, 200) for i in range(count)]
    seen = [row for row in every if min(row[2:]) > 0]  # what left the picture is not detected
    pixels = [{"frame": k, "u": f"{x:.1f}", "v": f"{y:.1f}", "track_id": i} for k, i, x, y in seen]
    stated = {"x": "u", "y": "v"}
    wishes = Wishes(time="frame", rate=30.0, columns=stated, units={"x": "px", "y": "px"})
    yield "pixels", told(table(folder / "pixels.csv", pixels), "truth", wishes=wishes, cut_off=10.0)
    boxes = [f"{k},-1,{x - 20:.1f},{y - 40:.1f},40,80,0.9,-1,-1,-1" for k, _, x, y in seen]
    (folder / "det.txt").write_text("\n".join(boxes) + "\n")
    yield "MOT", _counted(folder / "det.txt", count)
    lines = [json.dumps({"time": k / 30, "x": round(x / 10, 2), "y": round(y / 10, 2)}) for k, _, x, y in seen]
    (folder / "d.jsonl").write_text("\n".join(lines) + "\n")
    yield "JSON lines", _counted(folder / "d.jsonl", count)
    clusters = [
        {"stamp": f"{k / 10:.1f}", "cx": f"{x / 20:.2f}", "cy": f"{y / 20:.2f}", "cz": f"{rng.normal(1 + i / 4, 0.05):.2f}"}
        for k, i, x, y in seen
    ]
    yield "lidar", _counted(table(folder / "lidar.csv", clusters), count)


def _counted(path: Path, count: int) -> Row:
    """Return how many tracks a draft makes of a file of so many objects; a file of boxes as `new config` takes it."""
    from vedette.cli import main

    out = path.with_suffix(".toml")
    begun = time.process_time()
    code = main(["new", "config", str(path), "--out", str(out)])
    cpu = time.process_time() - begun
    result = vedette.load(out).run()
    figures: Row = {"exit": code, "objects": count, "tracks": len(result.tracks), "cpu": round(cpu, 1)}
    return figures | {"refused": result.intake.refused.count, "axes": " ".join(result.tracks[0].space.names)}


KINDS: Mapping[str, Callable[[Path, int], Iterator[tuple[str, Row]]]] = {
    "aircraft": aircraft, "circling": circling, "ships": ships, "noaa": noaa, "drone": drone, "circle": circle,
    "turning": turning, "cars": cars, "pictures": pictures,
}  # fmt: skip


def main() -> None:
    """Draft, run and judge; a line of JSON a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="NAME", help=f"of {', '.join(KINDS)}; default: all")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for kind in given.kinds or KINDS:
        with tempfile.TemporaryDirectory() as folder:
            for name, figures in KINDS[kind](Path(folder), given.seed):
                print(json.dumps({"kind": kind, "file": name} | {k: v for k, v in figures.items() if v != ""}), flush=True)


if __name__ == "__main__":
    main()
