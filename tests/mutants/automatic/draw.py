"""The draws of the frozen mutants: `PYTHONPATH=tests python -m mutants.automatic.draw` adds the last one to `frozen.json`.

Of a role, a kind is drawn; then with equal odds the file of its class or one that this imports from its own package; then an
operator that applies there; then a site. Seeds are those of `DRAWS`, no site is drawn twice, and none was chosen by hand.
Code changes: each later draw was made of the code of its day, before laws changed again.
"""

from __future__ import annotations

import ast
import importlib.util
import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import attrs
import numpy as np

from mutants.automatic.operators import Function, Site, sites
from support.paths import ROOT
from vedette.config.registry import Registry
from vedette.supporting import ImagingSensor

FROZEN = Path(__file__).with_name("frozen.json")
DRAWS = {
    36: {
        "motion": 80, "sensor": 80, "camera": 50, "associator": 80, "estimator": 80, "birth": 50, "lifecycle": 50,
        "preprocessor": 50, "source": 50,
    },
    37: {"associator": 30, "lifecycle": 20},
    38: {"camera": 20, "associator": 30, "preprocessor": 20, "source": 20},
    39: {"camera": 15, "preprocessor": 15, "source": 20},
    40: {"camera": 20, "preprocessor": 20, "source": 25},
    42: {
        "motion": 12, "sensor": 12, "camera": 12, "associator": 12, "estimator": 12, "birth": 12, "lifecycle": 12,
        "preprocessor": 12, "source": 20,
    },
    43: {
        "motion": 12, "sensor": 12, "camera": 12, "associator": 12, "estimator": 12, "birth": 12, "lifecycle": 12,
        "preprocessor": 12, "source": 16,
    },
    44: {
        "motion": 12, "sensor": 12, "camera": 12, "associator": 12, "estimator": 12, "birth": 12, "lifecycle": 12,
        "preprocessor": 12, "source": 16,
    },
}  # fmt: skip
"""By seed, how many of a role; cameras apart from the other sensors, as their laws are."""

ROLES = tuple(DRAWS[36])

NEED_FILES = {"autoferry", "csv", "jsonl", "mot", "radar_pictures", "video", "video_stream"}
OF_STUDIES = ("reproduction", "outcome", "verdicts", "configs", "scenes")
"""Modules of published studies, which no component runs."""

UNSEEN = {"__attrs_post_init__", "__str__", "__repr__", "refuses", "vedette_components", "explain"}
"""Functions that say what is wrong with what is given, and do nothing else."""


@attrs.frozen
class Mutant:
    """A site in a function of a file, and the kinds of a role that are tried with it."""

    name: str
    role: str
    kinds: tuple[str, ...]
    file: str
    function: str
    site: Site


@cache
def files_of_kinds() -> dict[str, dict[str, tuple[str, list[str]]]]:
    """Return by role and kind the file in which its class stands, and those that this imports from its own package."""
    found: dict[str, dict[str, tuple[str, list[str]]]] = {role: {} for role in ROLES}
    for entry in Registry.installed():
        if entry.role not in {*ROLES, "sensor"} or (entry.role == "source" and entry.kind in NEED_FILES):
            continue
        role = "camera" if issubclass(entry.cls, ImagingSensor) else entry.role
        own = entry.cls.__module__
        package = own.partition(".")[0]
        if package.startswith("vedette_"):
            others = sorted(_file(module) for module in _imported(own, package) - {own})
            found[role][entry.kind] = (_file(own), others)
    return found


def _file(module: str) -> str:
    return Path(importlib.util.find_spec(module).origin).relative_to(ROOT).as_posix()


def _imported(module: str, package: str) -> set[str]:
    """Return the modules of a package that a module imports, itself and theirs among them; those of studies left out."""
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in seen or name.rpartition(".")[2] in OF_STUDIES:
            continue
        seen.add(name)
        source = Path(importlib.util.find_spec(name).origin).read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            other = node.module or "" if isinstance(node, ast.ImportFrom) else ""
            if other.partition(".")[0] == package and not importlib.util.find_spec(other).origin.endswith("__init__.py"):
                waiting.append(other)
    return seen


def functions(tree: ast.AST, within: str = "") -> dict[str, Function]:
    """Return the functions of a module and the methods of its classes, by qualified name; not those within functions."""
    found: dict[str, Function] = {}
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef) and node.name not in UNSEEN:
            found[within + node.name] = node
        elif isinstance(node, ast.ClassDef):
            found |= functions(node, f"{within}{node.name}.")
    return found


def drawn(seed: int, counts: Mapping[str, int], before: Sequence[Mutant] = ()) -> list[Mutant]:
    """Draw so many mutants of some roles, of sites that none before has."""
    rng = np.random.default_rng(seed)
    mutants: list[Mutant] = []
    for role, kinds in files_of_kinds().items():
        if role not in counts:
            continue
        taken = {(mutant.file, mutant.function, mutant.site) for mutant in before if mutant.role == role}
        first = sum(mutant.role == role for mutant in before)
        left: dict[str, dict[str, list[tuple[str, Site]]]] = {}
        for file in {file for own, others in kinds.values() for file in (own, *others)}:
            left[file] = {}
            for name, node in functions(ast.parse((ROOT / file).read_text(encoding="utf-8"))).items():
                for site in (site for site in sites(node) if (file, name, site) not in taken):
                    left[file].setdefault(site.operator, []).append((name, site))
        of_role: list[Mutant] = []
        while len(of_role) < counts[role]:
            kind = sorted(kinds)[rng.integers(len(kinds))]
            own, others = kinds[kind]
            file = own if not others or rng.random() < 0.5 else others[rng.integers(len(others))]
            if not left[file]:
                continue
            operator = sorted(left[file])[rng.integers(len(left[file]))]
            function, site = left[file][operator].pop(rng.integers(len(left[file][operator])))
            if not left[file][operator]:
                del left[file][operator]
            sharing = [other for other in sorted(kinds) if other != kind and file in (kinds[other][0], *kinds[other][1])]
            of_role.append(Mutant(f"{role} {first + len(of_role)}", role, (kind, *sharing[:1]), file, function, site))
        mutants += of_role
    return mutants


def frozen() -> list[Mutant]:
    """Return the mutants that were drawn before the laws changed."""
    rows = json.loads(FROZEN.read_text(encoding="utf-8"))["mutants"]
    return [Mutant(**{**row, "kinds": tuple(row["kinds"]), "site": Site(**row["site"])}) for row in rows]


if __name__ == "__main__":
    seed, counts = list(DRAWS.items())[-1]
    before = frozen()
    mutants = [*before, *drawn(seed, counts, before)]
    rows = ",\n".join(json.dumps(attrs.asdict(mutant)) for mutant in mutants)
    FROZEN.write_text(f'{{\n"seeds": {list(DRAWS)},\n"mutants": [\n{rows}\n]\n}}\n', encoding="utf-8")
