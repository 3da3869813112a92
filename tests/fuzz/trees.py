"""Changes of plain data: tables and lists, as configs and JSON hold them."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from fuzz.cases import NASTY, pick

Place = tuple[Any, Any]
"""A table or list, and the name or index of something in it."""


def places(tree: Any) -> Iterator[Place]:
    """Yield every place of a tree."""
    parts = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for name, value in list(parts):
        yield tree, name
        yield from places(value)


def mutated(rng: np.random.Generator, tree: Any, others: list[Any], nasty: list[Any] = NASTY) -> Any:
    """Return a tree with one to three changes; parts may come from `others`."""
    tree = copy.deepcopy(tree)
    for _ in range(int(rng.integers(1, 4))):
        known = list(places(tree))
        if not known:
            return tree
        holder, name = pick(rng, known)
        change = int(rng.integers(8))
        if change <= 2:
            holder[name] = copy.deepcopy(pick(rng, nasty))
        elif change == 3:
            del holder[name]
        elif change == 4:
            there, other = pick(rng, list(places(pick(rng, others))) or known)
            holder[name] = copy.deepcopy(there[other])
        elif change == 5 and isinstance(holder, dict):
            holder[f"{name}{pick(rng, ['', 's', '_', ' '])}"] = holder.pop(name)
        elif change == 6 and isinstance(holder, list):
            holder.insert(int(rng.integers(len(holder) + 1)), copy.deepcopy(holder[name]))
        elif type(holder[name]) in (int, float) and abs(holder[name]) < 1e300:
            holder[name] = holder[name] * float(pick(rng, [-1, 0, 1e-30, 1e30, 1.5]))
        else:
            holder[name] = [holder[name]] if rng.random() < 0.5 else {"kind": holder[name]}
    return tree
