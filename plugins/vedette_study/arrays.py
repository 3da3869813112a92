"""A study's labelled arrays in a Zarr store."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

from vedette_study.outcome import Outcome


def write_zarr(folder: Path, outcome: Outcome) -> str:
    """Write `study.zarr` beside the old one, then put it in its place; returns its name."""
    name = "study.zarr"
    unfinished = folder / f".{name}.part"
    shutil.rmtree(unfinished, ignore_errors=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr's own, on strings and on metadata that it may change
        outcome.dataset().to_zarr(unfinished, mode="w", consolidated=False)
    shutil.rmtree(folder / name, ignore_errors=True)
    unfinished.rename(folder / name)
    return name
