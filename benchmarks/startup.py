"""What `import vedette` costs compared with `import numpy`: whole processes in turn, medians and the ratio's spread.

python benchmarks/startup.py [RUNS]
"""

from __future__ import annotations

import subprocess
import sys
from statistics import median, quantiles
from time import perf_counter

COMMANDS = {
    "python alone": "pass",
    "import numpy": "import numpy",
    "import vedette": "import vedette",
    "every public name": "import vedette; [getattr(vedette, name) for name in dir(vedette) if name[0] != '_']",
}


def seconds(code: str) -> float:
    """Return the wall time of one fresh interpreter that runs `code`."""
    start = perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    return perf_counter() - start


def main() -> None:
    """Print a table; the commands take turns, so that a machine that slows down slows all of them."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 21
    rounds = [{name: seconds(code) for name, code in COMMANDS.items()} for _ in range(runs)]
    print(f"{'':20s} {'median':>9s} {'of import numpy: median':>24s} {'quartiles':>14s}")
    for name in COMMANDS:
        ratios = [one[name] / one["import numpy"] for one in rounds]
        low, _, high = quantiles(ratios, n=4)
        print(
            f"{name:20s} {1e3 * median(one[name] for one in rounds):6.0f} ms {median(ratios):24.2f} {low:6.2f} - {high:.2f}"
        )


if __name__ == "__main__":
    main()
