"""The result of a study from its folder, without running anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from attrs import evolve

from vedette.errors import InputError
from vedette_files.json_values import read_table
from vedette_study.execution import Chunks
from vedette_study.outcome import Outcome, outcome
from vedette_study.plan import plan
from vedette_study.store import MANIFEST, Store

MOST_RUNS = 10**9
"""Runs of a point, or of a chunk."""


def is_study(folder: Path) -> bool:
    """Return whether a folder is that of a study."""
    return (folder / MANIFEST).exists()


def read_outcome(folder: Path) -> Outcome:
    """Return the result that `vedette study` left in a folder. InputError if it is unfinished or of another Vedette."""
    unfinished = "there is no such file; `vedette study --resume` finishes the study"
    made, told = (read_table(folder / name, unfinished) for name in (MANIFEST, "summary.json"))
    kinds = {"table": dict, "study": str, "vedette": str, "seed": int, "chunk": int}
    for table, name, wanted in ((made, MANIFEST, kinds), (told, "summary.json", {"runs": int, "interrupted": bool})):
        for key, kind in wanted.items():
            if type(table.get(key)) is not kind or (key in ("runs", "chunk") and not 0 < table[key] <= MOST_RUNS):
                raise InputError(f"{folder / name}: {key}: must be of {kind.__name__} as `vedette study` wrote it")
    planned = plan(made["table"])
    if planned.hash != made["study"]:
        text = f"this Vedette reads its study otherwise than Vedette {made['vedette']}, which made it; run the study anew"
        raise InputError(f"{folder / MANIFEST}: {text}")
    planned = evolve(planned, runs=told["runs"], seed=made["seed"], chunk=made["chunk"])
    store, chunks = Store(folder), list[Any]()
    for k in range(planned.count):
        found = [store.read(i, k, len(planned.runs_of(k))) for i in range(len(planned.points))]
        if any(chunk is None for chunk in found):
            raise InputError(f"{folder}: chunk {k} is missing or not whole; `vedette study --resume` makes it again")
        chunks.append(found)
    whole: Chunks = chunks
    return outcome(planned, whole, interrupted=told["interrupted"])
