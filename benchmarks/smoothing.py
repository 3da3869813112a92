"""`vedette smooth` beside movingpandas and lines on recorded ships and aircraft, and on two Dask workers.

    python -m benchmarks.smoothing [held | workers | rows]...

held: a tenth of the reports of every second ship with an even number, and of all aircraft, is held back, and positions
are compared with them; CPU a row. movingpandas' `KalmanSmootherCV` has of `NOISES` the pair that is best at a tenth of the
reports that are kept. workers: five million made reports by one and by two Dask workers, wall and CPU: where nothing else
runs, two are faster by the CPU of one over that of the busier of two, each with that of the process which parts and
gathers. rows: CPU a row and the largest memory of processes that smooth 1 and 10 million.
Needs `pip install movingpandas==0.23.0 stonesoup` for its column, and the folder of recordings in VEDETTE_DATA.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import vedette
from vedette.progress import silent
from vedette.space import Array, Mask
from vedette_tools.smoothing.files import smooth_files

SHIPS, AIRCRAFT = ("solent_ais", "SolentAIS_20160112_130211.csv"), ("adsb", "area_20min.csv")
NOISES = {"ships": ((0.03, 0.1, 0.3), (1.0, 5.0)), "aircraft": ((1.0, 3.0, 10.0, 30.0), (1.0, 10.0, 50.0, 100.0))}
"""Of movingpandas: m/s^1.5 and m."""

ROUNDS = 1
METRES = 111_195.0


def recorded(what: str) -> Any:
    """Return the reports of every second ship with an even number, or of all aircraft, in metres around each, by time."""
    import pandas as pd

    frame = pd.read_csv(Path(os.environ["VEDETTE_DATA"]).joinpath(*(SHIPS if what == "ships" else AIRCRAFT)))
    frame = frame.rename(columns={"MMSI": "name", "Time": "time", "SOG_knots": "speed_kn", "COG_degrees": "course"})
    frame = frame.rename(columns={"icao24": "name", "time_utc": "time", "groundspeed_kn": "speed_kn", "track_deg": "course"})
    frame = frame.rename(columns={"Latitude_degrees": "latitude", "Longitude_degrees": "longitude"})
    frame = frame.dropna(subset=["latitude", "longitude"])
    frame = frame.sort_values(["name", "time"], kind="stable").drop_duplicates(["name", "time"])
    if what == "ships":
        even = sorted(ship for ship in frame["name"].unique() if ship % 2 == 0)[::2]
        frame = frame[frame["name"].isin(even)]
    frame = frame.reset_index(drop=True)
    middle = frame.groupby("name")[["latitude", "longitude"]].transform("mean")
    north = (frame["latitude"] - middle["latitude"]) * METRES
    east = (frame["longitude"] - middle["longitude"]) * METRES * np.cos(np.radians(middle["latitude"]))
    when = pd.to_datetime(frame["time"], utc=True)
    return frame[["name", "speed_kn", "course"]].assign(time=when, x=east, y=north)


def drawn(frame: Any, among: Mask, seed: int) -> Mask:
    """Return a tenth of the reports `among` all, each between two others of its ship."""
    own = frame["name"].to_numpy()
    inner = np.concatenate([[False], (own[1:-1] == own[:-2]) & (own[1:-1] == own[2:]), [False]])
    return inner & among & (np.random.default_rng(seed).random(len(frame)) < 0.1)


def by_vedette(frame: Any, kept: Mask) -> Array:
    """Return the positions (n, 2) that smoothing gives where only some reports are known."""
    hidden = frame.copy()
    hidden.loc[~kept, ["x", "y", "speed_kn", "course"]] = np.nan
    return vedette.smooth_positions(hidden, by="name")[["x", "y"]].to_numpy()


def between(frame: Any, kept: Mask, spots: Array) -> Array:
    """Return the positions on lines between those `spots` of the reports that are kept."""
    when, found = frame["time"].astype("int64").to_numpy(), np.zeros((len(frame), 2))
    for rows in frame.groupby("name").indices.values():
        own = rows[kept[rows]]
        for axis in (0, 1):
            found[rows, axis] = np.interp(when[rows], when[own], spots[own, axis]) if len(own) else 0.0
    return found


def by_movingpandas(frame: Any, kept: Mask, accel: float, sigma: float) -> Array:
    """Return the positions between those that movingpandas smooths."""
    import geopandas as gpd
    import movingpandas as mpd

    spots = frame[["x", "y"]].to_numpy().copy()
    for rows in frame.groupby("name").indices.values():
        own = rows[kept[rows]]
        if len(own) > 2:
            place = gpd.points_from_xy(*spots[own].T)
            table = gpd.GeoDataFrame(geometry=place, crs=31256, index=frame["time"].iloc[own].dt.tz_localize(None))
            smooth = mpd.KalmanSmootherCV(mpd.Trajectory(table, 1)).smooth(accel, sigma).df.geometry
            spots[own] = np.stack([smooth.x, smooth.y], axis=-1)
    return between(frame, kept, spots)


def held(what: str) -> None:
    """Print the errors at held-back reports of ships or aircraft, and the CPU a row."""
    frame = recorded(what)
    real, every = frame[["x", "y"]].to_numpy(), np.ones(len(frame), dtype=bool)
    kept = ~drawn(frame, every, 34)
    inner = drawn(frame, kept, 35)

    def error(found: Array, rows: Mask) -> Array:
        return np.linalg.norm(found - real, axis=-1)[rows]

    def line(frame: Any, kept: Mask) -> Array:
        return between(frame, kept, real)

    ways: dict[str, Callable[[Any, Mask], Array]] = {"vedette": by_vedette, "lines": line}
    try:
        import movingpandas  # noqa: F401

        pairs = list(product(*NOISES[what]))
        tried = [error(by_movingpandas(frame, kept & ~inner, *pair), inner).mean() for pair in pairs]
        best = pairs[int(np.argmin(tried))]
        ways[f"movingpandas {best}"] = lambda frame, kept: by_movingpandas(frame, kept, *best)
    except ImportError:
        print("movingpandas is not installed")
    few = frame["name"].isin(frame["name"].unique()[:3]).to_numpy()
    for name, way in ways.items():
        way(frame[few].reset_index(drop=True), kept[few])  # so that imports are not counted
        began = time.process_time()
        off = error(way(frame, kept), ~kept)
        cpu = (time.process_time() - began) / kept.sum() * 1e6
        told = f"mean {off.mean():.2f}, median {np.median(off):.2f}, 90 % {np.percentile(off, 90):.2f} m"
        print(f"{what}: {name:24} {told} at {len(off):,} reports; {cpu:,.0f} us of CPU a row")


def made(place: Path, objects: int, reports: int = 500) -> Path:
    """Write the reports of objects that turn at times, in the order of time, a Parquet file."""
    import pyarrow as pa
    from pyarrow import parquet

    rng = np.random.default_rng(0)
    course = np.cumsum(rng.normal(0, 0.02, (reports, objects)), axis=0) + rng.uniform(0, 2 * np.pi, objects)
    steps = 10.0 * rng.uniform(1, 10, objects) * np.stack([np.cos(course), np.sin(course)])
    spots = np.cumsum(steps, axis=1) + rng.uniform(-2e4, 2e4, (2, 1, objects)) + rng.normal(0, 5.0, steps.shape)
    who, when = np.tile(np.arange(objects), reports), np.repeat(10.0 * np.arange(reports), objects)
    table = pa.table({"time": when, "mmsi": 235000000 + who, "x": spots[0].ravel(), "y": spots[1].ravel()})
    parquet.write_table(table, place)
    return place


def workers() -> None:
    """Print how much faster two Dask workers are than one."""
    from distributed import Client, LocalCluster

    def cpu() -> float:
        return resource.getrusage(resource.RUSAGE_SELF).ru_utime + resource.getrusage(resource.RUSAGE_SELF).ru_stime

    with TemporaryDirectory() as name:
        folder = Path(name)
        data, seen = made(folder / "d.parquet", 10_000), dict[int, list[float]]()
        for turn in range(ROUNDS):
            for count in (1, 2):
                options = {"dashboard_address": None, "silence_logs": 50, "threads_per_worker": 1}
                with LocalCluster(n_workers=count, processes=True, **options) as cluster, Client(cluster) as client:
                    client.run(import_module, "vedette_tools.smoothing.table")
                    pool, out = client.get_executor(), folder / f"{turn}-{count}"
                    before, own, began = client.run(cpu), cpu(), time.perf_counter()
                    smooth_files([data], out, "mmsi", None, None, pool, silent)
                    wall, here = time.perf_counter() - began, cpu() - own
                    there = [after - before[name] for name, after in client.run(cpu).items()]
                seen.setdefault(count, []).append(here + max(there))
                print(f"{count} workers: {wall:.1f} s, CPU {here:.1f} s here and {', '.join(f'{one:.1f}' for one in there)}")
        alone, both = (float(np.median(seen[count])) for count in (1, 2))
        print(f"by CPU two are {alone / both:.2f} times as fast")


def rows() -> None:
    """Print CPU a row on one core, and the largest memory."""
    for objects in (2000, 20_000):
        with TemporaryDirectory() as name:
            data, out = Path(name) / "d.parquet", Path(name) / "s.parquet"
            # A process counts the memory of the one that began it as its own: the table is made by another.
            maker = get_context("spawn").Process(target=made, args=(data, objects))
            maker.start()
            maker.join()
            command = [sys.executable, "-m", "vedette", "smooth", str(data), "--workers", "1", "--out", str(out)]
            _, status, used = os.wait4(subprocess.Popen(command, stdout=subprocess.DEVNULL).pid, 0)
            if status:
                raise RuntimeError(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
            spent = used.ru_utime + used.ru_stime
            told = f"{spent / (500 * objects) * 1e6:.1f} us of CPU a row, at most {used.ru_maxrss / 1024:.0f} MB"
            print(f"{500 * objects:,} rows: {told}")


def main(asked: list[str]) -> None:
    """Run the parts that are named, by default all but the long one of rows."""
    for name in asked or ["held", "workers"]:
        for part in {"held": [partial(held, what) for what in NOISES], "workers": [workers], "rows": [rows]}[name]:
            part()


if __name__ == "__main__":
    main(sys.argv[1:])
