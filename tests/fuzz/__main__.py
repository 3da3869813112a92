"""Fuzzing as a command: `python -m fuzz`, some minutes with the defaults; `--hours 8` goes on with further seeds.

Each fuzzer runs in a process of its own with a ceiling on its memory. A fault is told with its seed and case, and
`--only inputs --seed 3 --case 1234` runs that one again. Exit code 1 if anything escaped, hung or crashed.
"""

from __future__ import annotations

import argparse
import faulthandler
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BUDGETS = {
    "configs": 20_000,
    "inputs": 20_000,
    "kernels": 50_000,
    "plugins": 5_000,
    "methods": 2_000,
    "tables": 1_000,
    "results": 20_000,
    "adapters": 1_000,
    "live": 1_000,
    "commands": 1_000,
    "folders": 1_000,
}
MODULES = {"kernels": "kernel_calls", "methods": "faulty"}
"""Where a fuzzer is, if not in the module of its name."""

CRASH_SECONDS = 120.0
"""A case that cannot be stopped, in compiled code, ends its process after so long."""


def main() -> int:
    """Run all fuzzers, or one of them here."""
    parser = argparse.ArgumentParser("fuzz", description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hours", type=float, default=0.0, help="go on with further seeds for so long")
    parser.add_argument("--memory", type=float, default=4.0, help="GiB of address space of a fuzzer")
    parser.add_argument("--only", choices=list(BUDGETS))
    parser.add_argument("--case", type=int, help="one case of --only, with its traceback")
    parser.add_argument("--share", type=float, default=1.0, help="part of the usual numbers of cases")
    for name, budget in BUDGETS.items():
        parser.add_argument(f"--{name}", type=int, default=budget, help="cases of a seed")
    given = parser.parse_args()
    if given.only and given.case is not None:
        return _one(given.only, given.seed, given.case)
    if given.only:
        return _here(given.only, given.seed, max(1, round(given.share * getattr(given, given.only))), given.memory)
    end, seed, worst = time.monotonic() + 3600.0 * given.hours, given.seed, 0
    while True:
        for name in BUDGETS:
            cases = str(max(1, round(given.share * getattr(given, name))))
            command = [sys.executable, "-m", "fuzz", "--only", name, "--seed", str(seed), f"--{name}", cases]
            environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OPENCV_LOG_LEVEL": "SILENT"}
            code = subprocess.run([*command, "--memory", str(given.memory)], env=environment, check=False).returncode
            if code not in (0, 1):
                print(f"{name}, seed {seed}: the process ended with code {code}: a crash, a hang, or too much memory")
            worst = max(worst, int(code != 0))
        seed += 1
        if time.monotonic() >= end:
            return worst


def _here(name: str, seed: int, cases: int, memory: float) -> int:
    from fuzz.cases import carry_out

    ceiling = int(memory * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (ceiling, ceiling))
    case = case_of(name)

    def note(i: int) -> None:
        faulthandler.dump_traceback_later(CRASH_SECONDS, exit=True)
        os.pwrite(log.fileno(), f"{i:12d}".encode(), 0)

    faulthandler.enable()
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, Path(folder, "case").open("wb") as log:
        outcome = carry_out(case, seed, range(cases), Path(folder), note)
    faulthandler.cancel_dump_traceback_later()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{name}, seed {seed}: {outcome}; {time.perf_counter() - began:.0f} s, at most {peak:.2f} GiB", flush=True)
    for found in outcome.found:
        print(f"  {found}; again with: python -m fuzz --only {name} --seed {seed} --case {found.case}")
    return int(bool(outcome.found))


def _one(name: str, seed: int, number: int) -> int:
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        print(case_of(name)(np.random.default_rng([seed, number]), Path(folder)))
    return 0


def case_of(name: str):  # type: ignore[no-untyped-def]
    """Return what draws and tries one case of a fuzzer."""
    from importlib import import_module

    return import_module(f"fuzz.{MODULES.get(name, name)}").case


if __name__ == "__main__":
    sys.exit(main())
