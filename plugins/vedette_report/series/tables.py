"""The tables of a run's series: those of no rows, and several put together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vedette_files import Column, Tables


def together(parts: Sequence[Tables]) -> dict[str, dict[str, Column]]:
    """Return tables with the rows of all parts."""
    return {
        table: {name: np.concatenate([part[table][name] for part in parts]) for name in columns}
        for table, columns in parts[0].items()
    }


def no_rows(n: int, m: int, modes: int, *, links: bool = False) -> Tables:
    """Return the tables of a run that no judge has seen, without rows: n state axes, at most m measured ones.

    `links`: tracks have the probabilities of their links.
    """
    real, short = np.float64, np.int32
    scans: dict[str, Any] = {"time": real, "sensor": np.int16, "returns": short, "tracks": short, "columns": short}
    scans |= {"platform": (real, 2), "heading": real}
    entries = {
        "scan": short,
        "track": np.int64,
        "mean": (real, n),
        "cov": (real, n * (n + 1) // 2),
        "confirmed": np.bool_,
        "existence": real,
        "hit": real,
        "miss": real,
        "identity": np.int64,
        **({"link": real} if links else {}),
        "nis": real,
        "modes": (real, modes),
        "expected": (real, m),
        "innovation": (real, m * (m + 1) // 2),
        "gate_position": (real, 2),
        "gate_cov": (real, 3),
    }
    kinds: dict[str, dict[str, Any]] = {
        "scans": scans,
        "returns": {"scan": short, "z": (real, m), "position": (real, 2)},
        "entries": entries,
        "weights": {"entry": np.int64, "return": short, "weight": real},
        "below": {"entry": np.int64, "place": short, "value": real},
        "splits": {"scan": short, "track": np.int64, "parent": np.int64},
        "merges": {"scan": short, "track": np.int64, "into": np.int64},
    }
    return {table: {name: _no_row(kind) for name, kind in columns.items()} for table, columns in kinds.items()}


def _no_row(kind: Any) -> Any:
    dtype, *shape = kind if isinstance(kind, tuple) else (kind,)
    return np.zeros((0, *shape), dtype)
