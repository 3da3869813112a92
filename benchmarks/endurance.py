"""Memory along a long run, `python -m benchmarks.endurance [--scans N] [--vessels N]`: resident, and whether it is flat.

Two runs, each in a process of its own, as `vedette run --stream` does them: vessels that come and go in a simulated harbour
for a day (86,400 scans), and one track for 10^6 scans. The first tenth of a run is left out: caches fill in it.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time
from typing import Any, TypeVar

T = TypeVar("T")

LIMIT = 0.05
"""What a run may grow by from its first tenth to its end."""
DAY, LONG = 86_400, 1_000_000
_SIDE = 20_000.0
_KEPT = {"kind": "given", "start": {"x": [0.0, 10.0], "y": [0.0, 10.0], "vx": [0.0, 1.0], "vy": [0.0, 1.0]}}


def harbour(scans: int, vessels: int, keeps: bool = False) -> dict[str, Any]:
    """Return a config of `vessels` at a time, each for an hour, seen by one radar for `scans` seconds in clutter."""
    import numpy as np

    dice, ships, life = np.random.default_rng(1), {}, 3600.0
    for i in range(vessels):
        begin, turn = -life * i / vessels, 0
        while begin < scans:
            appears, ends = max(begin, 0.0), begin + life
            ships[f"vessel {i}.{turn}"] = {
                "start": dice.uniform(-_SIDE, _SIDE, 2).tolist(),
                "course": float(dice.uniform(-np.pi, np.pi)),
                "speed": float(dice.uniform(2.0, 10.0)),
                "appears": appears,
                **({"disappears": ends} if ends < scans else {}),
            }
            begin, turn = ends, turn + 1
    bounds = {axis: {"low": -1.5 * _SIDE, "high": 1.5 * _SIDE} for axis in "xy"}
    source = {
        "kind": "simulation",
        "duration": float(scans - 1),
        "looks": {"radar": {"interval": 1.0, **({} if keeps else {"clutter": bounds})}},
        "ships": {"one": {"start": [0.0, 0.0], "speed": 1e-3}} if keeps else ships,
    }
    return {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {
            "radar": {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9, "clutter_density": 5e-9}
        },
        "associator": {"kind": "gnn"},
        "birth": _KEPT if keeps else {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "single_target" if keeps else "m_of_n"},
        "source": source,
    }


def resident() -> float:
    """MB that this process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def follow(config: dict[str, Any], samples: int = 20) -> dict[str, Any]:
    """Run a config as `vedette run --stream` does; MB along it, and what became of its tracks."""
    import vedette
    from vedette_report.running.streaming import stream

    experiment, held = vedette.load(config), list[float]()

    def watched(scans: Sequence[T], about: str, /) -> Iterator[T]:
        every = max(len(scans) // samples, 1)
        for i, scan in enumerate(scans):
            if i % every == 0:
                held.append(resident())
                print(f"{i:,} of {len(scans):,} scans: {held[-1]:.1f} MB", file=sys.stderr, flush=True)
            yield scan

    with tempfile.TemporaryDirectory() as folder:
        begun = process_time()
        done = stream(experiment, Path(folder), progress=watched)
        seconds = process_time() - begun
        spans: dict[str, list[float]] = {}
        with (Path(folder) / "tracks.csv").open() as file:
            next(file)
            for line in file:
                number, time, _ = line.split(",", 2)
                span = spans.setdefault(number, [float(time), float(time), 0.0])
                span[1], span[2] = float(time), span[2] + 1
        gaps = sum(count != last - first + 1 for first, last, count in spans.values())
    held.append(resident())
    settled = held[len(held) // 10 :]
    return {
        "scans": done.figures["scans_taken"],
        "begun": done.figures["begun"],
        "confirmed": done.figures["tracks"],
        "reused_ids": gaps,
        "seconds": seconds,
        "mb": held,
        "growth": max(settled) / settled[0] - 1.0,
    }


def main() -> int:
    """Measure both runs, each in its own process; 1 if one is not flat or an id comes twice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, default=DAY, help="of the harbour; 0 leaves it out")
    parser.add_argument("--vessels", type=int, default=50, help="at a time in the harbour")
    parser.add_argument("--long", type=int, default=LONG, help="scans of the one track; 0 leaves it out")
    given = parser.parse_args()
    code = "import json, sys; from benchmarks.endurance import follow; print(json.dumps(follow(json.load(sys.stdin))))"
    failed = False
    for name, scans, vessels in ((f"{given.vessels} vessels", given.scans, given.vessels), ("one track", given.long, 0)):
        if not scans:
            continue
        config = harbour(scans, vessels, keeps=not vessels)
        done = subprocess.run(
            [sys.executable, "-c", code], input=json.dumps(config), check=True, stdout=subprocess.PIPE, text=True
        )
        found = json.loads(done.stdout)
        bad = found["growth"] > LIMIT or found["reused_ids"] > 0
        failed |= bad
        print(
            f"{name}: {found['scans']:,} scans, {found['confirmed']:,} tracks confirmed of {found['begun']:,} begun, "
            f"{found['reused_ids']} ids used again; {found['seconds']:.0f} s of CPU time"
        )
        print(f"  MB along it: {' '.join(f'{mb:.1f}' for mb in found['mb'])}; growth {100 * found['growth']:.1f} %")
        print("  NOT FLAT" if bad else "  flat")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
