"""Write a scene of radar pictures to a folder: PNG files and tables of times, own ship's poses and the truth.

python -m vedette_sim.marine_write examples/darc_scene.toml FOLDER [--seed N] [--set NAME=VALUE]
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve

import vedette
from vedette import ConfigError, InputError, Progress, VedetteError
from vedette.progress import silent
from vedette_marine.ais import KNOT, rate_of_turn
from vedette_marine.geometry import write_geometry
from vedette_report.progress import on_terminal
from vedette_sim.marine_scene import RadarPicturesScene
from vedette_sim.marine_surroundings import land_mask
from vedette_sim.polar_fields import opencv

FRAMES = ("file", "time_s", "heading_rad", "east_m", "north_m", "east_mps", "north_mps")
TRUTH = ("object", "time_s", "east_m", "north_m", "east_mps", "north_mps", "heading_rad", "length_m", "width_m")
AIS = ("Time", "MMSI", "Latitude_degrees", "Longitude_degrees", "COG_degrees", "SOG_knots", "Heading_degrees", "ROT")


def write_pictures(scene: RadarPicturesScene, folder: Path, rng: np.random.Generator, progress: Progress = silent) -> int:
    """Write everything that the source `radar_pictures` reads; return the number of pictures.

    The same `rng` gives the same pictures as the scene used as a source. Each picture's row is written with it, so that
    what exists after an interruption can be read.
    """
    seed = int(rng.integers(2**63))
    painter, times = scene.painter(seed), scene.times(seed)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        geometry = painter.geometry
        if scene.land and scene.chart:
            geometry = evolve(geometry, land="land.png")
            chart = land_mask(scene.land, scene.radar.size, scene.radar.metres_per_pixel)
            _write(folder / geometry.land, chart)
        write_geometry(folder, geometry)
        _table(folder / "truth.csv", TRUTH, _truth_rows(scene, times))
        _table(folder / "ais.csv", AIS, _ais_rows(scene, seed))
        with (folder / "frames.csv").open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(FRAMES)
            for number, time in enumerate(progress(times.tolist(), "pictures")):
                name = f"{number:06d}.png"
                _write(folder / name, np.moveaxis(painter.pixels(time), 0, 2))
                pose = scene.ownship.pose(time)
                velocity = np.zeros(2) if pose.velocity is None else pose.velocity
                bow = np.mod(0.5 * np.pi - float(pose.heading), 2.0 * np.pi)
                rows.writerow([name, *(f"{value:.6f}" for value in (time, bow, *pose.position, *velocity))])
                file.flush()
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error}") from None
    return len(times)


def _write(path: Path, picture: Any) -> None:
    cv2 = opencv()
    fine, coded = cv2.imencode(".png", np.ascontiguousarray(picture), [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not fine:
        raise InputError(f"{path}: OpenCV cannot write this picture")
    path.write_bytes(coded.tobytes())


def _table(path: Path, titles: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(titles)
        table.writerows(rows)


def _truth_rows(scene: RadarPicturesScene, times: Any) -> Iterable[list[object]]:
    for path in scene.centres(times):
        for time, (x, y, vx, vy, heading, length, width) in zip(path.times.tolist(), path.states.tolist(), strict=True):
            bow = np.mod(0.5 * np.pi - heading, 2.0 * np.pi)
            yield [path.name, *(f"{value:.6f}" for value in (time, x, y, vx, vy, bow, length, width))]


def _ais_rows(scene: RadarPicturesScene, seed: int) -> Iterable[list[object]]:
    """Return all reports in order of time."""
    rows: list[tuple[float, list[object]]] = []
    for sent in scene.ais(seed).values():
        rot = rate_of_turn(-np.degrees(sent.turn) * 60.0)
        for i, time in enumerate(sent.time.tolist()):
            row: list[object] = [f"{time:.2f}", sent.mmsi, f"{sent.latitude[i]:.8f}", f"{sent.longitude[i]:.8f}"]
            row += [f"{np.degrees(sent.course[i]):.1f}", f"{sent.speed[i] / KNOT:.1f}", f"{np.degrees(sent.heading[i]):.0f}"]
            row.append("" if np.isnan(rot[i]) else f"{rot[i]:.0f}")
            rows.append((time, row))
    return (row for _, row in sorted(rows, key=lambda timed: timed[0]))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        prog="python -m vedette_sim.marine_write", description="Write a scene of radar pictures."
    )
    parser.add_argument("config", help="a config whose [source] is a radar_pictures_scene")
    parser.add_argument("folder", help="folder for the pictures; created if missing")
    parser.add_argument("--seed", type=int, help="default: the config's")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="change the config")
    given = parser.parse_args(arguments)
    try:
        experiment = vedette.load(given.config, overrides=given.set)
        scene = experiment.source
        if not isinstance(scene, RadarPicturesScene):
            got = "none" if scene is None else repr(scene.kind)
            raise ConfigError.at("source.kind", f"must be 'radar_pictures_scene', got {got}")
        # As a run of the config does, so that a tracker sees the same pictures either way.
        rng = np.random.default_rng(experiment.seed if given.seed is None else given.seed).spawn(2)[0]
        with on_terminal() as progress:
            count = _written(scene, Path(given.folder), rng, progress)
    except VedetteError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; the pictures so far can be read", file=sys.stderr)
        return 130
    print(f"{count} pictures in {given.folder}")
    return 0


def _written(scene: RadarPicturesScene, folder: Path, rng: np.random.Generator, progress: Progress) -> int:
    try:
        return write_pictures(scene, folder, rng, progress)
    except ConfigError as error:
        raise error.within("source") from None


if __name__ == "__main__":
    sys.exit(main())
