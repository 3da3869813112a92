"""The page of a large run in a real Chromium: its size, when it is ready, and what a move of its slider takes.

    python -m benchmarks.page                                    200 tracks x 1,000 scans x 300 returns a scan
    python -m benchmarks.page --run out/harbour                  the page of a run that is there

The large run is drawn, not tracked: its numbers are random to the last bit, so they compress worse than a tracker's. The
script of a move is timed within the page, over 200 moves all over the run, a frame each; `ready` is the time from opening
the file to the first picture. Needs Chromium and playwright.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from vedette_files.series import SeriesFile
from vedette_report.page.build import write_page

FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync")
MOVES = """async () => {
  const times = [], count = page.data.scans.count;
  for (let i = 0; i < 200; i++) {
    const begin = performance.now();
    page.goTo(Math.floor(count * ((i * 0.6180339887) % 1)));
    times.push(performance.now() - begin);
    await new Promise(requestAnimationFrame);
  }
  return times;
}"""


def draw(folder: Path, tracks: int, scans: int, returns: int) -> None:
    """Write the files of a run that never was: tracks that wander, with random covariances, gates and figures."""
    rng = np.random.default_rng(1)
    e = tracks * scans
    place = np.cumsum(rng.normal(size=(scans, tracks, 2)) * 8.0, axis=0) + rng.uniform(-5e3, 5e3, (tracks, 2))
    mean = np.concatenate([place.reshape(e, 2), rng.normal(size=(e, 2)) * 5], axis=1)
    cov = np.exp(rng.normal(size=(e, 10)))
    cov[:, 1] *= 0.1
    own = rng.integers(0, returns, e).astype(np.int32)
    spots = rng.uniform(-6e3, 6e3, (scans * returns, 2))
    figures = {name: np.exp(rng.normal(size=e)) for name in ("nis", "nees", "nis_given_hit", "position_error")}
    figures |= {name: np.exp(rng.normal(size=e)) for name in ("position_sigma", "velocity_error", "velocity_sigma")}
    figures |= {name: rng.uniform(size=e) for name in ("existence", "hit")}
    scan, chi = np.repeat(np.arange(scans, dtype=np.int32), tracks), np.exp(0.1 * rng.normal(size=(7, scans)))
    band = {"nees_low": 1.7, "nees_high": 2.3, "nis_low": 1.7, "nis_high": 2.3}
    modes = rng.uniform(size=e)
    tables: dict[str, dict[str, Any]] = {
        "scans": {
            "time": np.arange(scans) * 2.5,
            "sensor": np.zeros(scans, np.int16),
            "returns": np.full(scans, returns, np.int32),
            "tracks": np.full(scans, tracks, np.int32),
            "platform": np.full((scans, 2), np.nan),
            "heading": np.full(scans, np.nan),
            "judged": np.ones(scans, bool),
            "covered": np.full(scans, tracks, np.int32),
            "position_rmse": chi[0],
            "nees": 2 * chi[1],
            "nis": 2 * chi[2],
            **{f"{name}_count": np.full(scans, tracks, np.int32) for name in ("nees", "nis")},
            **{name: np.full(scans, value) for name, value in band.items()},
        },
        "returns": {"scan": np.repeat(np.arange(scans, dtype=np.int32), returns), "z": spots, "position": spots},
        "entries": {
            "scan": scan,
            "track": np.tile(np.arange(tracks), scans),
            "mean": mean,
            "cov": cov,
            "confirmed": np.ones(e, bool),
            "modes": np.stack([modes, 1 - modes], axis=1),
            "expected": mean[:, :2],
            "innovation": cov[:, :3],
            "gate_position": mean[:, :2] + rng.normal(size=(e, 2)),
            "gate_cov": cov[:, :3] + np.array([25.0, 0.0, 25.0]),
            "object": np.tile(np.arange(tracks, dtype=np.int32), scans),
            **figures,
        },
        "weights": {"entry": np.repeat(np.arange(e), 2), "return": np.repeat(own, 2), "weight": rng.uniform(0.01, 1, 2 * e)},
        "truth": {
            "scan": scan,
            "object": np.tile(np.arange(tracks, dtype=np.int32), scans),
            "position": mean[:, :2] + rng.normal(size=(e, 2)) * 3,
        },
    }
    sensor = {"axes": {"x": "m", "y": "m"}, "gate": 9.21, "band": [0.05, 7.38], "place": None}
    about = {
        "title": f"{tracks} tracks, {scans} scans, {scans * returns} returns",
        "axes": {"x": "m", "y": "m", "vx": "m/s", "vy": "m/s"},
        "map": {"axes": ["x", "y"], "labels": ["x [m]", "y [m]"]},
        "unit": "m",
        "sensors": {"radar": sensor},
        "objects": [f"object {i}" for i in range(tracks)],
        "modes": ["one", "two"],
        "band": 0.95,
        "nees_band": [0.05, 7.38],
        "notes": {},
    }
    file = SeriesFile(folder / "series.npz", about)
    file.add(tables)
    file.flush()
    (folder / "config.json").write_text(json.dumps({"sensors": {"radar": {"kind": "cartesian_position"}}}))
    (folder / "summary.txt").write_text("drawn, not tracked\n")


def measure(page: Path, rounds: int) -> dict[str, Any]:
    """Return when the page was ready, in ms, and what moves of the slider took, over some openings."""
    from playwright.sync_api import sync_playwright

    ready, moves, said = [], [], []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
        for _ in range(rounds):
            tab = browser.new_page(viewport={"width": 1400, "height": 900})
            tab.on("console", lambda message: said.append(message.text))
            tab.on("pageerror", lambda error: said.append(str(error)))
            tab.goto(page.as_uri())
            while not tab.evaluate("document.documentElement.dataset.ready || 0"):
                tab.wait_for_timeout(20)
            ready.append(int(tab.evaluate("document.documentElement.dataset.ready")))
            moves.append(tab.evaluate(MOVES))
            tab.close()
        browser.close()
    return {"ready": ready, "moves": np.array(moves), "said": said}


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser("python -m benchmarks.page", description=__doc__)
    parser.add_argument("--run", metavar="DIR", help="the page of this run instead of a large one")
    parser.add_argument("--tracks", type=int, default=200)
    parser.add_argument("--scans", type=int, default=1000)
    parser.add_argument("--returns", type=int, default=300, help="in each scan")
    parser.add_argument("--rounds", type=int, default=3, help="how often the page is opened")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(options.run) if options.run else Path(name)
        if not options.run:
            draw(folder, options.tracks, options.scans, options.returns)
        before, page = process_time(), Path(name) / "report.html"
        write_page(folder, page)
        print(f"size {page.stat().st_size / 1e6:.2f} MB, written in {process_time() - before:.2f} s")
        found = measure(page, options.rounds)
    quantiles = [f"{np.percentile(found['moves'], q, axis=1).min():.1f}" for q in (50, 95, 100)]
    print(f"ready after {', '.join(map(str, found['ready']))} ms")
    print(f"script of a move of the slider: median {quantiles[0]}, p95 {quantiles[1]}, worst {quantiles[2]} ms (best round)")
    print("p95 of each round: " + ", ".join(f"{value:.1f}" for value in np.percentile(found["moves"], 95, axis=1)) + " ms")
    print(f"on the console: {found['said'] or 'nothing'}")


if __name__ == "__main__":
    main()
