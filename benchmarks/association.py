"""All associators and kinds of hypotheses on scenes of boats that cross, go side by side and merge: one table with errors.

    python -m benchmarks.association                 12 runs of each scene; some 5 minutes
    python -m benchmarks.association --runs 5        a rough picture
    python -m benchmarks.association --write         puts the table into docs/measured/association.md

Every tracker meets the same runs of a scene, so that differences are paired by run: to `jpda` with the same births, and of
`jpda` with Poisson births to that without. A tracker whose kinds are not installed is left out, and said to be.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import vedette
from vedette.config.files import read_file
from vedette_study.outcome import Outcome
from vedette_study.statistics import Mean
from vedette_study.study import monte_carlo

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "measured" / "association.md"
BEGIN, END = "<!-- association: begin -->", "<!-- association: end -->"
FIGURES = ("gospa", "trajectory_gospa", "hota", "coverage", "id_switches", "false_tracks")
COLUMNS = ("GOSPA [m]", "trajectory GOSPA [m]", "HOTA", "coverage", "identity switches", "false tracks")
DIGITS = (1, 1, 3, 3, 2, 2)
BIRTHS = ", Poisson births"
PAIRED = {
    "gospa": ("GOSPA less jpda's", 2),
    "hota": ("HOTA less jpda's", 3),
    "id_switches": ("identity switches less jpda's", 2),
}

KINDS = ("nearest", "gnn", "pda", "jpda", "jpda_star", "m_best_jpda", "variational", "k_best", "n_scan", "lmb")
JOINT = ("jpda", "variational", "k_best", "n_scan", "lmb")
POISSON = {
    "kind": "poisson",
    "lifetime": 240,
    "appear": [{"at": {"x": [0, 700], "y": [0, 700], "vx": [0, 6], "vy": [0, 6]}, "initial": 8.0, "rate": 0.033}],
}
TRACKERS: dict[str, dict[str, Any]] = {kind: {"associator": {"kind": kind}} for kind in KINDS} | {
    f"{kind}{BIRTHS}": {"associator": {"kind": kind}, "birth": POISSON} for kind in JOINT
}
"""Name to changes in the tracker of examples/fleet.toml. Poisson births make multi-Bernoulli filters and mixtures of it."""

CRUISE = {"models": [{"kind": "constant_velocity", "sigma_accel": 0.05}]}
MEETING = CRUISE | {"count": 3, "at": [0, 0], "time": 90, "speed": 8, "angle": "20 deg", "spread": 5}
FERRIES = {
    "count": 2,
    "spacing": 20,
    "formation": "abreast",
    "wander": {"kind": "gauss_markov", "axes": ["x", "y"], "sigma": 3, "tau": 20},
    "leader": CRUISE | {"start": {"x": [-700, 50], "y": [0, 50], "vx": [8, 1], "vy": [0, 1]}},
}
CELL = {"x": 25, "y": 25}
SCENES: dict[str, dict[str, Any]] = {
    "three cross": {"crossings": {"meeting": MEETING}},
    "three cross, cells of 25 m": {"crossings": {"meeting": MEETING}, "resolution": CELL},
    "two 20 m apart": {"convoys": {"ferries": FERRIES}},
    "two 20 m apart, cells of 25 m": {"convoys": {"ferries": FERRIES}, "resolution": CELL},
    "examples/fleet.toml": {},
}


def config(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return the config of examples/fleet.toml, with the groups of a scene in place of its own."""
    table = read_file(ROOT / "examples" / "fleet.toml")
    if scene:
        source = {
            name: part for name, part in table["source"].items() if name not in ("populations", "crossings", "convoys")
        }
        look = {name: part for name, part in source["looks"]["radar"].items() if name != "resolution"}
        if "resolution" in scene:
            look["resolution"] = scene["resolution"]
        groups = {name: part for name, part in scene.items() if name != "resolution"}
        table["source"] = source | {"looks": {"radar": look}} | groups
    return table


def trackers(table: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return those of TRACKERS that can be built here."""
    found = {}
    for name, changes in TRACKERS.items():
        try:
            vedette.load(dict(table) | changes)
        except vedette.ConfigError as error:
            print(f"{name}: left out: {str(error).splitlines()[0]}", file=sys.stderr)
        else:
            found[name] = changes
    return found


def rows(scene: str, outcome: Outcome) -> Iterator[str]:
    """Yield a line of the table for each tracker."""
    names = [str(point.labels["tracker"]) for point in outcome.plan.points]
    for i, name in enumerate(names):
        means = outcome.means(i)
        cells = [_cell(means[figure], digits) for figure, digits in zip(FIGURES, DIGITS, strict=True)]
        other = reference(name)
        less = outcome.differences(i, names.index(other)) if other in names else {}
        cells += [_cell(less[figure], digits) if less else "" for figure, (_, digits) in PAIRED.items()]
        yield f"| {scene if i == 0 else ''} | {name} | {' | '.join(cells)} |"


def reference(name: str) -> str | None:
    """Return the tracker from which one of TRACKERS differs in one thing."""
    if name.endswith(BIRTHS) and name != f"jpda{BIRTHS}":
        return f"jpda{BIRTHS}"
    return "jpda" if name != "jpda" else None


def _cell(mean: Mean, digits: int) -> str:
    return f"{mean.value:.{digits}f} +- {mean.error or 0:.{digits}f}"


def main() -> None:
    """Run all scenes and print the table."""
    parser = argparse.ArgumentParser("python -m benchmarks.association", description=__doc__)
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--scenes", default="", metavar="WORDS", help="scenes whose name has these words")
    parser.add_argument("--trackers", nargs="*", default=list(TRACKERS), metavar="NAME", help="these only")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    chosen = {name: changes for name, changes in trackers(config({})).items() if name in given.trackers}
    columns = ["scene", "tracker", *COLUMNS, *(said for said, _ in PAIRED.values())]
    lines = [f"| {' | '.join(columns)} |", "| --- " * len(columns) + "|"]
    for name, scene in SCENES.items():
        if given.scenes not in name:
            continue
        outcome = monte_carlo(config(scene), given.runs, seed=1, trackers=chosen)
        for line in rows(name, outcome):
            print(line, flush=True)
            lines.append(line)
    if given.write:
        page = PAGE.read_text(encoding="utf-8")
        head, tail = page.split(BEGIN)[0], page.split(END)[1]
        told = f"{given.runs} runs a scene; +- is one standard error.\n\n" + "\n".join(lines)
        PAGE.write_text(f"{head}{BEGIN}\n{told}\n{END}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
