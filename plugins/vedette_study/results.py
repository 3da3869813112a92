"""The result of a study from its folder, without running anything."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from attrs import evolve

from vedette.errors import InputError
from vedette_study.execution import Chunks
from vedette_study.outcome import Outcome, outcome
from vedette_study.plan import plan
from vedette_study.store import MANIFEST, Store


def is_study(folder: Path) -> bool:
    """Return whether a folder is that of a study."""
    return (folder / MANIFEST).exists()


def read_outcome(folder: Path) -> Outcome:
    """Return the result that `vedette study` left in a folder. InputError if it is unfinished or of another Vedette."""
    made, told = _read(folder / MANIFEST), _read(folder / "summary.json")
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


def _read(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; `vedette study --resume` finishes the study") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
    if not isinstance(table, dict):
        raise InputError(f"{path}: must be a table")
    return table
