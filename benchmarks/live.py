"""A live service under load, `python -m benchmarks.live [--seconds N] [--rate N]`: latency, memory, and what becomes of all.

JSON lines over UDP on loopback, 100 scans/s of 100 returns of 50 targets, `jpda`; then ten times as many a second. Latency
is from before a scan's datagram is sent to after the report that holds it has come. Every message that was sent is taken,
refused, dropped by the service, or lost by the system, and the counts say so.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from typing import Any

import numpy as np
from attrs import frozen

from benchmarks.machine import described

TARGETS, RETURNS, SIDE, SIGMA, SEEN = 50, 100, 10_000.0, 10.0, 0.9
GOAL = 0.020
"""s that the 99th percentile of the latency is to stay below."""
_HEAD = re.compile(rb'"time": ([-+.e0-9]+)')


def config(port: int, back: int) -> dict[str, Any]:
    """Return the config of the service."""
    clutter = (RETURNS - SEEN * TARGETS) / SIDE**2
    return {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {
            "radar": {
                "kind": "cartesian_position",
                "sigma": SIGMA,
                "detection_probability": SEEN,
                "clutter_density": clutter,
            }
        },
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 15.0, "vy": 15.0}},
        "lifecycle": {"kind": "existence", "lifetime": "10 min", "confirm": 0.99, "delete": 0.01},
        "inputs": [{"input": {"kind": "udp", "port": port}, "format": {"kind": "json_lines"}}],
        "outputs": [{"output": {"kind": "udp", "port": back}, "format": {"kind": "json_lines"}}],
    }


def datagrams(count: int, rate: float) -> list[bytes]:
    """Return scans, each as one datagram."""
    rng = np.random.default_rng(1)
    place, velocity = rng.uniform(0, SIDE, (TARGETS, 2)), rng.normal(0, 10, (TARGETS, 2))
    made = []
    for k in range(count):
        seen = (place + velocity * k / rate)[rng.random(TARGETS) < SEEN]
        false = rng.uniform(0, SIDE, (RETURNS - len(seen), 2))
        z = np.concatenate([seen + rng.normal(0, SIGMA, seen.shape), false]).round(2)
        made.append(json.dumps({"time": k / rate, "z": rng.permutation(z).tolist()}).encode())
    return made


@frozen
class Load:
    """What came of one run: counts of the service, latencies (n,) in s, and the MB that it held each second."""

    sent: int
    counts: dict[str, int]
    latencies: np.ndarray[Any, np.dtype[np.float64]]
    held: np.ndarray[Any, np.dtype[np.float64]]

    def told(self, rate: float) -> str:
        """Return the lines that say it."""
        names = ("messages_taken_total", "messages_refused_total", "messages_dropped_total", "datagrams_lost_total")
        taken, refused, dropped, lost = (self.counts[name] for name in names)
        sums = taken + refused + dropped + lost == self.sent
        parts = f"{taken} taken + {refused} refused + {dropped} dropped + {lost} lost by the system"
        lines = [f"{rate:g} scans/s: {self.sent} sent = {parts}: {'yes' if sums else 'NO'}"]
        if len(self.latencies):
            p50, p99, worst = (1e3 * float(q) for q in np.quantile(self.latencies, (0.5, 0.99, 1.0)))
            lines.append(
                f"  latency p50 {p50:.1f} ms, p99 {p99:.1f} ms, at most {worst:.1f} ms, of {len(self.latencies)} scans"
            )
        settled = self.held[len(self.held) // 4 :]
        if len(settled) > 2:
            slope = float(np.polyfit(np.arange(len(settled)), settled, 1)[0]) * 60.0
            lines.append(f"  memory {settled[0]:.1f} to {settled[-1]:.1f} MB after a quarter, {slope:+.2f} MB a minute")
        return "\n".join(lines)


def resident(process: int) -> float:
    """MB that a process holds."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def run(seconds: float, rate: float) -> Load:
    """Send scans to a service of its own process for so long, and stop it."""
    scans = datagrams(round(seconds * rate), rate)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as back, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
        back.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**22)
        back.bind(("127.0.0.1", 0))
        here.bind(("127.0.0.1", 0))
        port = here.getsockname()[1] + 1
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "service.json"
            path.write_text(json.dumps(config(port, back.getsockname()[1])))
            command = [sys.executable, "-m", "vedette", "serve", str(path), "--json"]
            service = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            try:
                return _driven(service, here, back, ("127.0.0.1", port), scans, rate)
            finally:
                service.kill()
                service.wait()


def _driven(
    service: subprocess.Popen[bytes],
    here: socket.socket,
    back: socket.socket,
    to: tuple[str, int],
    scans: list[bytes],
    rate: float,
) -> Load:
    assert service.stderr is not None
    while b'"serving"' not in (line := service.stderr.readline()):
        if not line:
            raise RuntimeError("the service did not start")
    Thread(target=service.stderr.read, daemon=True).start()
    sleep(0.5)  # the input listens a moment after it is said
    came, done, held = list[tuple[float, float]](), Event(), list[float]()

    def receive() -> None:
        back.settimeout(0.2)
        while not done.is_set():
            try:
                data = back.recv(65_535)
            except TimeoutError:
                continue
            if (head := _HEAD.search(data, 0, 80)) is not None:
                came.append((monotonic(), float(head[1])))

    def watch() -> None:
        while not done.wait(1.0):
            held.append(resident(service.pid))

    others = [Thread(target=receive), Thread(target=watch)]
    for thread in others:
        thread.start()
    sent, begun = np.zeros(len(scans)), monotonic()
    for k, scan in enumerate(scans):
        if (early := begun + k / rate - monotonic()) > 0:
            sleep(early)
        sent[k] = monotonic()
        here.sendto(scan, to)
    more = 5  # the system tells what it dropped with the next datagram that it did not
    for k in range(more):
        sleep(1.0)
        here.sendto(json.dumps({"time": (len(scans) + k) / rate, "z": []}).encode(), to)
    sleep(1.0)
    done.set()
    for thread in others:
        thread.join()
    service.send_signal(signal.SIGTERM)
    assert service.stdout is not None
    counts = json.loads(service.stdout.read().splitlines()[-1])
    moments, times = np.array(came).reshape(-1, 2).T
    first = np.searchsorted(times, np.arange(len(scans)) / rate - 1e-9)
    held_by = first < len(times)
    return Load(len(scans) + more, counts, moments[first[held_by]] - sent[held_by], np.array(held))


def main() -> None:
    """Measure at the rate and at ten times that."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.live", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=300.0, help="of the first run; the second one takes a tenth")
    parser.add_argument("--rate", type=float, default=100.0, help="scans a second")
    given = parser.parse_args()
    print(described(), flush=True)
    load = run(given.seconds, given.rate)
    print(load.told(given.rate), flush=True)
    print(f"  p99 below {1e3 * GOAL:g} ms: {'yes' if np.quantile(load.latencies, 0.99) < GOAL else 'no'}", flush=True)
    print(run(given.seconds / 10, 10 * given.rate).told(10 * given.rate))


if __name__ == "__main__":
    main()
