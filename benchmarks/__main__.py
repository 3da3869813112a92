"""Compare the speed of Vedette with both of its kernels, textbook numpy, FilterPy, Stone Soup, simdkalman and the C limit.

    python -m benchmarks                 everything, about ten minutes; --quick: a rough picture within a minute
    python -m benchmarks --only "KF"     the heats whose title has these words
    python -m benchmarks --write         puts the tables into docs/measured/speed.md

Every contender runs in its own process, first shows that it solves the problem (against textbook numpy), and then all
take turns; times are CPU times, ratios are taken within a round and shown as median and quartiles. A peer that is not
installed is left out. `nox -s benchmarks` installs the peers in an environment of their own and runs this.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import monotonic

from benchmarks import footprint, table, users
from benchmarks.machine import described
from benchmarks.plan import BATCHES, FOREIGN, GROWTH, ONLINE, Entry, Heat, grown
from benchmarks.race import ROOT, Contender, Race, run

PEERS = ("filterpy", "stonesoup", "simdkalman")
TOLERANCE = {"stonesoup": 1e-6}
"""Stone Soup differentiates its range and bearing numerically."""


def options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few rounds, no batches of 100,000, less growth")
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="heats whose title has these words; no growth, no imports"
    )
    parser.add_argument(
        "--peers-python",
        action="append",
        default=[],
        metavar="[NAME=]PATH",
        help="the interpreter that has the peers, or the peer of this name; may be given several times",
    )
    parser.add_argument("--write", action="store_true", help="write the tables into docs/measured/speed.md")
    return parser.parse_args()


def known(peers_python: list[str]) -> dict[str, tuple[str, str, dict[str, str]]]:
    """Return the contenders: module, interpreter, environment."""
    pythons = dict.fromkeys(PEERS, sys.executable)
    for given in peers_python:
        name, _, path = given.rpartition("=")
        if name not in ("", *PEERS) or not Path(path).exists():
            sys.exit(f"--peers-python: must be PATH or NAME=PATH, NAME one of {', '.join(PEERS)}, PATH there; got {given}")
        pythons |= {name: path} if name else dict.fromkeys(PEERS, path)
    own: dict[str, tuple[str, str, dict[str, str]]] = {
        name: (name, sys.executable, {}) for name in ("vedette", "textbook", "limit")
    }
    twin = {"vedette numpy": ("vedette", sys.executable, {"VEDETTE_KERNELS": "numpy"})}
    return own | twin | {name: (name, pythons[name], {}) for name in PEERS}


class Bench:
    """The contenders, and the time limit of each heat."""

    def __init__(self, peers_python: list[str], quick: bool) -> None:
        self.known = known(peers_python)
        self.contenders = {
            name: Contender(name, module, python, **more) for name, (module, python, more) in self.known.items()
        }
        self.rounds, self.sample, self.budget = (3, 0.01, 1.0) if quick else (15, 0.05, 12.0)
        self.told = [f"{name}: {one.version or 'not there: ' + str(one.absent)}" for name, one in self.contenders.items()]

    def race(self, heat: Heat) -> Race:
        """Run one heat, and report it as it ends."""
        began = monotonic()
        entries = [(self.contenders[name], level) for name, level in heat.entries]
        race = run(heat.case, entries, self.rounds, self.sample, self.budget, TOLERANCE)
        counted = len(next(iter(race.each.values()), []))
        print(f"{heat.title}: {counted} rounds, {monotonic() - began:.1f} s", file=sys.stderr, flush=True)
        for reason in race.refused.values():
            self.told.append(f"{heat.title}: {reason}")
            print(f"  left out: {reason}", file=sys.stderr, flush=True)
        return race

    def growth(self, quick: bool) -> dict[str, tuple[Entry, dict[int, float]]]:
        """Measure time against each size."""
        found: dict[str, tuple[Entry, dict[int, float]]] = {}
        for what, values, family, entry in GROWTH:
            found[what] = (entry, {})
            for value in values[:3] if quick else values:
                heat = Heat(f"{value} {what}", grown(what, family, value), (entry,))
                if time := self.race(heat).seconds(entry):
                    runs = value if what.startswith("runs") else 1  # the time of all runs together
                    found[what][1][value] = time.middle * runs
        return found

    def close(self) -> None:
        """End the processes."""
        for contender in self.contenders.values():
            contender.close()


def main() -> None:
    """Measure, print, and write if asked to; what was measured before an interruption is printed."""
    chosen = options()
    machine = described()
    print(machine, file=sys.stderr)
    page = ROOT / "docs" / "measured" / "speed.md"
    if first := users.table(chosen.only, 2 if chosen.quick else 7, page if chosen.write else None):
        print(first, flush=True)
    bench = Bench(chosen.peers_python, chosen.quick)
    heats = [heat for heat in (*ONLINE, FOREIGN, *BATCHES) if chosen.only.lower() in heat.title.lower()]
    if chosen.quick:
        heats = [heat for heat in heats if (heat.case.tracks or 0) <= 1000]
    races: dict[str, Race] = {}
    larger: dict[str, tuple[Entry, dict[int, float]]] = {}
    light = None
    try:
        for heat in heats:
            races[heat.title] = bench.race(heat)
        if not chosen.only:
            larger = bench.growth(chosen.quick)
    except KeyboardInterrupt:
        bench.told.append("interrupted: not all was measured")
    finally:
        bench.close()
    if not chosen.only and "interrupted" not in bench.told[-1]:
        light = footprint.measure(bench.known, 3 if chosen.quick else 11)
    if chosen.quick:
        bench.told.append("a quick run: few rounds, short samples")
    text = table.report(machine, races, larger, light, bench.told)
    print(text)
    if chosen.write:
        table.write(text, page)


if __name__ == "__main__":
    main()
