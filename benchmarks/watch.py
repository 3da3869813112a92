"""`vedette watch` as its readers see it: scans received and drawn, and the time from a scan to its picture.

    python -m benchmarks.watch                       a browser at 60 scans/s, readers at 1,000 scans/s, a slow reader
    python -m benchmarks.watch --only drawn --tracks 500 --seconds 30

Each line is a run of the command in a process of its own, on a recording of a simulated scene, as recorded.

drawn: 200 tracks at 60 scans/s in Chromium. Every scan is in some picture. Of those after the page's first picture, those
`on their own` are the last ones on a picture; the others were drawn together with a later one. The delay is from when a
scan came until the first picture that has it has been painted, by the browser's clock, of the last 5,000 of them.
received: 1,000 scans/s of 5 targets, by a client that counts and by Chromium.
slow: a reader that takes 20 kB/s beside one that counts: whether the run or the other reader notices.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from threading import Thread
from time import perf_counter, sleep, time
from typing import Any
from urllib.parse import urlsplit

import numpy as np

import vedette
from benchmarks.page import FLAGS
from vedette_files import write_recording

SEEN = """() => {
  const sorted = [...live.stats.delays].sort((a, b) => a - b), at = (q) => sorted[Math.floor(q * (sorted.length - 1))];
  const first = live.stats.first - performance.timeOrigin, delays = [at(0.5), at(0.99), at(1)];
  const { ended, data } = live, tracks = data.tracks.confirmed.length;
  return { ...live.stats, first, delays, ended, tracks };
}"""


def config(targets: int, rate: float, seconds: float) -> dict[str, Any]:
    """Return a scene of so many targets that stay, so far apart that their returns are told from each other."""
    side = 150.0 * np.sqrt(targets)
    area = {axis: {"low": 0.0, "high": side} for axis in "xy"}
    motion = {"kind": "constant_velocity", "sigma_accel": 0.5}
    population = {"models": [motion], "area": area, "start": {"vx": [0, 10], "vy": [0, 10]}, "count": targets}
    return {
        "title": f"{targets} targets, {rate:g} scans/s",
        "source": {
            "kind": "simulation",
            "duration": seconds,
            "looks": {"radar": {"interval": 1.0 / rate, "clutter": area}},
            "populations": {"target": population},
        },
        "estimator": {"kind": "kalman", "motion": motion},
        "sensors": {
            "radar": {
                "kind": "cartesian_position",
                "sigma": 3.0,
                "detection_probability": 0.95,
                "clutter_density": 4e-7,
            }
        },
        "gate": {"probability": 0.999},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n", "hits": 3, "looks": 3, "misses": 10},
    }


@contextmanager
def watching(made: dict[str, Any]) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run the command on a recording of a scene; give the address of its page."""
    with tempfile.TemporaryDirectory() as name:
        path, recorded = Path(name) / "config.json", Path(name) / "recording.jsonl"
        experiment = vedette.load(made)
        spaces = {sensor: each.measurement for sensor, each in experiment.tracker.sensors.items()}
        write_recording(recorded, experiment.steps().recording, spaces)
        path.write_text(json.dumps(made | {"source": {"kind": "jsonl", "path": str(recorded)}}))
        command = [sys.executable, "-m", "vedette", "watch", str(path), "--json"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip(), process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(30)


def events(address: str) -> HTTPResponse:
    """Return the open events of a page."""
    split = urlsplit(address)
    connection = HTTPConnection(split.netloc)
    connection.request("GET", f"{split.path}events")
    return connection.getresponse()


def counted(address: str) -> dict[str, Any]:
    """Read all events as a plain client does; return how many scans came, and the delays from scan to client in ms."""
    numbers: list[int] = []
    delays: list[float] = []
    begin = time()
    for line in events(address):
        if line.startswith(b"data: ") and len(line) > 40:
            raw, now, at = b64decode(line[6:]), time(), 0
            while at < len(raw):
                size, first, scans, came = np.frombuffer(raw, "<f8", 4, at)
                numbers += range(int(first), int(first + scans))
                if came > begin:
                    delays.append(1e3 * (now - came))
                at += int(size)
    gaps = int(np.count_nonzero(np.diff(numbers) != 1)) + (numbers[:1] != [0])
    return {"received": len(numbers), "gaps": gaps, "delays": quantiles(delays)}


def quantiles(values: list[float]) -> list[float]:
    """Return median, 99 % and worst."""
    return np.percentile(values, [50, 99, 100]).tolist() if values else [np.nan] * 3


def seen(address: str, seconds: float) -> dict[str, Any]:
    """Open the page in Chromium until the run has ended; return what it counted."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
        tab, said = browser.new_page(viewport={"width": 1400, "height": 900}), list[str]()
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.goto(address)
        end = perf_counter() + seconds + 30
        while perf_counter() < end and not tab.evaluate("Boolean(document.documentElement.dataset.ended)"):
            tab.wait_for_timeout(500)
        found: dict[str, Any] = tab.evaluate(SEEN)
        browser.close()
    return found | {"said": said}


def finished(process: subprocess.Popen[str]) -> int:
    """Return how many scans the run took, once it has ended."""
    output, _ = process.communicate(timeout=60)
    return int(json.loads(output.splitlines()[-1])["scans_taken"])


def told(delays: list[float]) -> str:
    """Return quantiles as text."""
    return "median {:.1f}, p99 {:.1f}, worst {:.1f} ms".format(*delays)


def drawn(tracks: int, rate: float, seconds: float, name: str = "drawn") -> None:
    """Watch in Chromium."""
    with watching(config(tracks, rate, seconds)) as (address, process):
        found = seen(address, seconds)
        taken = finished(process)
    own = (found["drawn"] - 1) / max(found["after"], 1)
    about = f"{name}: {tracks} targets, {rate:g} scans/s, {seconds:g} s, in Chromium"
    print(f"{about}: {found['received']} of {taken} scans, {found['tracks']} tracks")
    print(f"    {found['drawn']} pictures, the first after {found['first']:.0f} ms; {found['after']} scans came later,")
    print(f"    {own:.1%} of them on their own; to the picture {told(found['delays'])}")
    print(f"    on the console: {found['said'] or 'nothing'}")


def received(tracks: int, rate: float, seconds: float) -> None:
    """Watch by a plain client, then in Chromium."""
    with watching(config(tracks, rate, seconds)) as (address, process):
        found = counted(address)
        taken = finished(process)
    about = f"received: {tracks} targets, {rate:g} scans/s, {seconds:g} s, by a plain client"
    print(f"{about}: {found['received']} of {taken} scans, {found['gaps']} gaps; to the client {told(found['delays'])}")
    drawn(tracks, rate, seconds, "received")


def slow(tracks: int, rate: float, seconds: float) -> None:
    """Watch by two clients, one of which takes its time."""
    with watching(config(tracks, rate, seconds)) as (address, process):
        lazy, taken_by = events(address), 0
        result: dict[str, Any] = {}
        other = Thread(target=lambda: result.update(counted(address)))
        other.start()
        while other.is_alive():
            taken_by += len(lazy.read(1_000))
            sleep(0.05)
        behind = lazy.read()
        taken = finished(process)
    print(f"slow: {tracks} targets, {rate:g} scans/s, {seconds:g} s: the slow reader had {taken_by / 1e6:.2f} MB at the end")
    print(f"    and then took the {len(behind) / 1e6:.1f} MB that waited")
    print(f"    the other: {result['received']} of {taken} scans, {result['gaps']} gaps; {told(result['delays'])}")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser("python -m benchmarks.watch", description=__doc__)
    parser.add_argument("--only", choices=["drawn", "received", "slow"])
    parser.add_argument("--tracks", type=int, default=200, help="that are drawn")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    print(f"load average of the last minute, with {os.cpu_count()} cores: {os.getloadavg()[0]:.1f}")
    if options.only in (None, "drawn"):
        drawn(options.tracks, 60.0, options.seconds)
    if options.only in (None, "received"):
        received(5, 1000.0, options.seconds)
    if options.only in (None, "slow"):
        slow(options.tracks, 60.0, options.seconds)


if __name__ == "__main__":
    main()
