"""Runs that Ctrl-C ends at some moment, each in a fork: `python -m support.interrupting RUNS SEED CONFIG [--stream]`.

Prints for each a line of JSON: its exit code, and what it left in `out-N`.
"""

import json
import math
import random
import signal
import sys
from contextlib import redirect_stdout
from pathlib import Path
from time import monotonic

from support.killing import killed
from vedette.cli import main
from vedette_files import read_recording, read_series
from vedette_report.running import growing
from vedette_report.series import recorder as series


def left(place):
    """Return how many scans the files of a run hold, and whether it says that it was interrupted; None without results."""
    if not (place / "summary.json").exists():
        return None
    found = json.loads((place / "summary.json").read_text())
    return {
        "recorded": len(read_recording(place / "recording.jsonl")[0].scans),
        "series": len(read_series(place / "series.npz")["scans"]["time"]),
        "counted": found["scans_taken"],
        "interrupted": found["interrupted"],
    }


if __name__ == "__main__":
    runs, seed, command = int(sys.argv[1]), int(sys.argv[2]), ["run", *sys.argv[3:], "--out"]
    chance = random.Random(seed)
    series.SCANS, growing.BLOCKS = 4, 2
    with redirect_stdout(sys.stderr):
        main([*command, "warm"])  # all is loaded before it forks
    begin = monotonic()
    killed(math.inf, [*command, "whole"])
    seconds = monotonic() - begin
    for i in range(runs):
        place = Path(f"out-{i}")
        code = killed(chance.uniform(0.0, seconds), [*command, str(place)], signal.SIGINT)
        print(json.dumps({"code": code, "left": left(place)}), flush=True)
