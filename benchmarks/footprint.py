"""What contenders cost before they do any work: time to import, and memory."""

from __future__ import annotations

import os
import resource
import subprocess
from dataclasses import dataclass

from benchmarks.race import ONE_THREAD, Case, Contender, Spread

IMPORTS = {
    "vedette": "import vedette; vedette.build; import vedette_standard",
    "filterpy": "import filterpy.kalman",
    "stonesoup": "import stonesoup.predictor.kalman, stonesoup.updater.kalman, stonesoup.types.track",
    "simdkalman": "import simdkalman",
}
BATCH_LEVELS = {"vedette": "kernels", "limit": "", "simdkalman": ""}
"""The contenders that take batches."""
BATCH = Case("kf", 1, 100_000, 1, 4)


@dataclass
class Footprint:
    """Import times as multiples of numpy's, and MB held: by the imports alone, and at most during a large batch."""

    numpy_seconds: Spread
    imports: dict[str, Spread]
    imported: dict[str, float]
    batch: dict[str, float]


def cpu_seconds(python: str, code: str) -> float:
    """Return the CPU time of a fresh interpreter that runs `code`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([python, "-c", code], check=True, env={**os.environ, **ONE_THREAD}, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(known: dict[str, tuple[str, str, dict[str, str]]], rounds: int) -> Footprint:
    """Measure contenders; `known`: module, interpreter and environment by name."""
    batch, imported = {}, {}
    for name, (module, python, environment) in known.items():
        worker = Contender(name, module, python, **environment)
        if worker.absent is None:
            imported[name] = worker.hello["imported"]
            if module in BATCH_LEVELS:
                worker.ask("time", level=BATCH_LEVELS[module], repeats=1, **BATCH.sizes)
                batch[name] = worker.ask("memory")["peak"]
        worker.close()
    pythons = {name: known[name][1] for name in IMPORTS if name in imported}
    seconds: list[dict[str, float]] = []
    for _ in range(rounds):
        one = {f"numpy of {python}": cpu_seconds(python, "import numpy") for python in set(pythons.values())}
        seconds.append(one | {name: cpu_seconds(python, IMPORTS[name]) for name, python in pythons.items()})
    imports = {n: Spread.of([one[n] / one[f"numpy of {python}"] for one in seconds]) for n, python in pythons.items()}
    numpy_seconds = Spread.of([one[f"numpy of {pythons['vedette']}"] for one in seconds])
    return Footprint(numpy_seconds, imports, imported, batch)
