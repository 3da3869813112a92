"""What the laws say of the frozen mutants: `PYTHONPATH=tests python -m mutants.automatic.measure --into FILE`.

The code of one function is exchanged in a process of its own, and every kind that the mutant names is examined, exact laws
first, until an assertion fails; where it lives, other kinds of the role, too, that use its file. A line of JSON says what
came of it:

`caught`: a law failed on what the component gave. `raises`: laws failed at their first example, as something raised.
`hangs`: it ran out of CPU time. `lives`: every law held. `gone`: the code has no such site any more.
"""

from __future__ import annotations

import argparse
import ast
import functools
import gc
import json
import os
import re
import resource
import sys
import time
import types
import warnings
from collections.abc import Container
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve

from mutants.automatic.draw import Mutant, files_of_kinds, frozen, functions
from mutants.automatic.operators import mutated
from support.paths import ROOT
from vedette.config.registry import Registry
from vedette.testing import Misuse, Profile, examine, laws_of
from vedette.testing.strategies import components

SECONDS, ENOUGH = 45, 25
"""CPU time of a mutant at most, and from which on no further kind is tried."""

RAISED = re.compile(r"^(\S+ )?raised \w+|^\w+(Error|Exception|Iteration)\b")
RAISING_LAWS = 4
"""A component that raises at the first example of so many laws, with none that fails otherwise, is no lawful one."""


def put_in(mutant: Mutant) -> bool:
    """Exchange the code of the mutant's function wherever it lives; False if the source has no such site any more."""
    path = ROOT / mutant.file
    if not path.exists():
        return False
    tree = ast.parse(path.read_text(encoding="utf-8"))
    node = functions(tree).get(mutant.function)
    other = None if node is None else mutated(node, mutant.site)
    if other is None:
        return False
    for owner in ast.walk(tree):
        body = getattr(owner, "body", None)
        if isinstance(body, list) and node in body:
            body[body.index(node)] = other
    code = _code_of(compile(tree, str(path), "exec", dont_inherit=True), mutant.function)
    live = [
        found
        for found in gc.get_objects()
        if isinstance(found, types.FunctionType)
        and found.__qualname__ == mutant.function
        and found.__code__.co_filename == str(path)
    ]
    for function in live:
        function.__code__ = code
        for module in list(sys.modules.values()):  # nobody goes through the compiled function that takes its place
            if getattr(vars(module).get(mutant.function), "__wrapped__", None) is function:
                setattr(module, mutant.function, function)
    for found in gc.get_objects():
        if isinstance(found, functools._lru_cache_wrapper) and getattr(found, "__module__", "").startswith("vedette_"):
            found.cache_clear()
    return bool(live)


def _code_of(module: types.CodeType, name: str) -> types.CodeType:
    for constant in module.co_consts:
        if isinstance(constant, types.CodeType):
            if constant.co_qualname == name:
                return constant
            if name.startswith(f"{constant.co_qualname}."):
                return _code_of(constant, name)
    raise LookupError(name)


def judged(
    mutant: Mutant,
    profile: Profile,
    given: dict[tuple[str, str], dict[str, Any]],
    only: list[str],
    without: Container[str] = (),
) -> dict[str, Any]:
    """Put a mutant in and examine its kinds, until one is caught."""
    list(Registry.installed())  # what is not imported yet has no code that could be exchanged
    if not put_in(mutant):
        return {"verdict": "gone"}
    role = "sensor" if mutant.role == "camera" else mutant.role
    raising, began = {}, time.process_time()
    others = [kind for kind, (own, more) in files_of_kinds()[mutant.role].items() if mutant.file in (own, *more)]
    for kind in dict.fromkeys((*mutant.kinds, *sorted(others))):
        if kind not in mutant.kinds and time.process_time() - began > ENOUGH:
            break
        entry = Registry.installed().find(role, kind)
        if entry is None:
            continue
        cls = entry.cls
        try:
            drawn = components(cls, given.get((role, kind), {}))
        except (Misuse, Exception) as error:
            raising[f"{kind} is drawn"] = f"{type(error).__name__}: {error}"[:200]
            continue
        at_once = 0
        for law in sorted(laws_of(cls), key=lambda law: ("shown", "exact", "statistical", "long").index(law.effort)):
            if law.name in cls.known_failures or law.name in without or (only and law.name not in only):
                continue
            try:
                outcome = examine(cls, law, drawn, profile)
                verdict, text, tried = outcome.verdict, outcome.text, outcome.examples
            except Exception as error:  # the kit itself fell over what it was given
                verdict, text, tried = "failed", f"{type(error).__name__}: {error}", 1
            if verdict != "failed":
                continue
            first = (text.splitlines() or [""])[0][:200]
            if not RAISED.match(first) or tried > 1:
                said = {"verdict": "caught", "kind": kind, "law": law.name, "text": first}
                return said | {"cpu": round(time.process_time() - began, 2)}
            raising[law.name] = first
            at_once += 1
            if at_once == RAISING_LAWS:
                break
    verdict = "raises" if raising else "lives"
    return {"verdict": verdict, "laws": raising, "cpu": round(time.process_time() - began, 2)}


def apart(
    mutant: Mutant,
    profile: Profile,
    given: dict[tuple[str, str], dict[str, Any]],
    only: list[str],
    without: Container[str] = (),
) -> dict[str, Any]:
    """Judge a mutant in a process of its own, which may not take longer than `SECONDS` of CPU time nor 4 GB."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        code = 1
        try:
            os.close(reading)
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
            resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
            with os.fdopen(os.open(os.devnull, os.O_WRONLY), "w") as sink:
                os.dup2(sink.fileno(), 1)
                os.dup2(sink.fileno(), 2)
            with os.fdopen(writing, "w") as pipe:
                pipe.write(json.dumps(judged(mutant, profile, given, only, without)))
            code = 0
        finally:
            os._exit(code)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        said = pipe.read()
    os.waitpid(child, 0)
    return json.loads(said) if said else {"verdict": "hangs"}


def main(arguments: list[str] | None = None) -> None:
    """Judge the frozen mutants that FILE does not hold yet, a role after the other in turn."""
    from testing.test_conformance import GIVEN

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, required=True)
    parser.add_argument("--profile", default="fast")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--roles", nargs="*", default=[])
    parser.add_argument("--only", nargs="*", default=[], help="names")
    parser.add_argument("--laws", nargs="*", default=[], help="these alone: of mutants that lived by all others")
    parser.add_argument("--without", nargs="*", default=[], help="all laws but these")
    parser.add_argument("--part", default="0/1", help="i/n: every n-th, from the i-th")
    asked = parser.parse_args(arguments)
    lines = asked.into.read_text().splitlines() if asked.into.exists() else []
    done = {json.loads(line)["name"] for line in lines}
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    profile = evolve(Profile.named(asked.profile, asked.seed), shrink=False)
    files_of_kinds()  # once for all processes
    part, parts = map(int, asked.part.split("/"))
    rows = sorted(frozen(), key=lambda one: int(one.name.split()[1]))[part::parts]
    for mutant in rows:
        if mutant.name in done or (asked.roles and mutant.role not in asked.roles):
            continue
        if asked.only and mutant.name not in asked.only:
            continue
        row = {"name": mutant.name, "seed": asked.seed} | apart(mutant, profile, GIVEN, asked.laws, asked.without)
        with asked.into.open("a") as file:
            file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
