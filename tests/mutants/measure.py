"""Which law catches which mutant, and at what cost: `PYTHONPATH=tests python -m mutants.measure SET --into FILE`.

SET is `foreign` (mutants by an outsider), `controls` (the same wrapping without a fault), `right` (right components by an
outsider) or `own` (the mutants of `support.mutants`). Each component is tried on every law of its role; one line of JSON
says what each law said and what it cost in s of CPU. What FILE holds already is not tried again.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from pathlib import Path

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from foreign.catalogue import COMPONENTS
from mutants.foreign import MUTANTS
from mutants.foreign.base import mutant
from support.mutants.table import MUTANTS as OWN
from support.mutants.table import mutant as own_mutant
from vedette.config.parameters import role_of
from vedette.testing import Misuse, Profile, examine, laws_of
from vedette.testing.strategies import components


def foreign():
    for m in MUTANTS:
        made = m.make()
        yield m.name, m.role, m.label, type(made), st.just(made)


def controls():
    for i, m in enumerate({repr(m.right): m for m in MUTANTS}.values()):
        made = mutant(m.role, f"faultless_{i}", "None.", m.right).make()
        yield f"{i} {m.right.func.__name__}", m.role, "right", type(made), st.just(made)


def right():
    for c in COMPONENTS:
        made = c.make()
        try:
            drawn = st.one_of(st.just(made), components(type(made)))
        except Misuse:
            drawn = st.just(made)
        yield c.name, c.role, "right", type(made), drawn


def own():
    for what, base, _, methods, strategies in OWN:
        cls = own_mutant(base, methods)
        yield f"{base.__name__}: {what}", role_of(base), "wrong", cls, components(cls, strategies)


SETS = {"foreign": foreign, "controls": controls, "right": right, "own": own}


def measured(cls, drawn, profile, stop, first=()):
    """Return what each law said and its cost: the `first` ones before the others, statistical and long ones last."""
    caught, cost, skipped = {}, {}, {}
    laws = sorted(laws_of(cls), key=lambda law: (law.name not in first, law.effort not in ("exact", "shown")))
    for law in laws:
        if stop and caught:
            break
        begin = time.process_time()
        try:
            outcome = examine(cls, law, drawn, profile)
            verdict, text = outcome.verdict, outcome.text
        except Exception as error:  # the kit itself fell over what it was given: that is no verdict
            verdict, text = "failed", f"{type(error).__name__}: {error}"
        cost[law.name] = round(time.process_time() - begin, 3)
        if verdict == "failed":
            caught[law.name] = text.splitlines()[0][:300] if text else ""
        elif verdict == "skipped":
            skipped[law.name] = text
    return {"caught": caught, "cpu": cost, "skipped": skipped}


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--into", type=Path, required=True)
    parser.add_argument("--profile", default="fast")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--roles", nargs="*", default=[], help="in this order; default: all")
    parser.add_argument("--only", nargs="*", default=[], help="names")
    parser.add_argument("--missed-in", type=Path, help="a file of a fast run: those that it missed come first")
    parser.add_argument("--stop", action="store_true", help="at the first law that catches it")
    given = parser.parse_args(arguments)
    lines = given.into.read_text().splitlines() if given.into.exists() else []
    done = {(row["name"], row["seed"]) for row in map(json.loads, lines)}
    fast = {}
    if given.missed_in:
        fast = {row["name"]: row["caught"] for row in map(json.loads, given.missed_in.read_text().splitlines())}
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    rows = [row for row in SETS[given.set]() if not given.roles or row[1] in given.roles]
    rows.sort(key=lambda row: (len(fast.get(row[0], ())) > 0, given.roles.index(row[1]) if given.roles else 0))
    for seed in given.seeds:
        profile = evolve(Profile.named(given.profile, seed), shrink=False)
        for name, role, label, cls, drawn in rows:
            if (name, seed) in done or (given.only and name not in given.only):
                continue
            row = {"name": name, "role": role, "label": label, "profile": given.profile, "seed": seed}
            row |= measured(cls, drawn, profile, given.stop, tuple(fast.get(name, ())))
            with given.into.open("a") as file:
                file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
