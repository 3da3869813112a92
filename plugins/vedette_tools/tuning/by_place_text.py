"""What was found of a detection probability by place: in words, as plain data, and as a config."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vedette.config import path_of
from vedette_tools import toml_text
from vedette_tools.tuning.by_place import ByPlace
from vedette_tools.tuning.config_text import text_of
from vedette_tools.tuning.validation import Gain


def text(found: ByPlace) -> str:
    """Return the table, a row for each range, and the verdict of the scans held back."""
    return "\n".join(_lines(found))


def _lines(found: ByPlace) -> Iterator[str]:
    table = found.table
    yield from (f"LOOKS WRONG: {said}" for said in found.odd)
    one, all_of = found.scans
    yield f"{found.path}: detection probability {found.level:.3g} over all, was {found.before:.3g}; {found.rounds} runs"
    if np.ptp(table.probability) > 0:
        heads = ["from, m"] + [f"{float(np.degrees(each)):.0f} deg" for each in table.bearings]
        if len(table.bearings) == 1:
            heads[1] = "all around"
        rows = [heads]
        for distance, line, errors in zip(table.ranges.tolist(), table.probability, found.error, strict=True):
            cells = [f"{p:.2f} +- {error:.2f}" for p, error in zip(line.tolist(), errors.tolist(), strict=True)]
            rows.append([f"{distance:g}", *cells])
        widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
        yield from ("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
        if found.on is not None:
            yield f"log-likelihood of the {one} scans it was found from, table less one number: {found.on.text}"
        if found.held is not None:
            yield f"log-likelihood of the scans held back, table less one number: {found.held.text}"
    else:
        yield "no place differs: stretches of the recording do not foretell one another better by place"
    if found.level_held is not None:
        yield f"log-likelihood of the scans held back, one number less the config's own: {found.level_held.text}"
    yield "take the table" if found.advice == "take" else f"keep one number: {_why(found)}"
    if all_of == one:
        yield "no scans were held back, so nothing judges it"


def _why(found: ByPlace) -> str:
    return "nothing differs" if not np.ptp(found.table.probability) else "on the scans held back the table is no better"


def data(found: ByPlace) -> dict[str, Any]:
    """Return all figures as plain data."""
    table = found.table
    return {
        "title": found.title, "sensor": found.path, "warnings": list(found.odd), "before": found.before,
        "level": found.level, "ranges_m": table.ranges.tolist(), "bearings_rad": table.bearings.tolist(),
        "probability": table.probability.tolist(), "error": found.error.tolist(), "trials": found.trials.tolist(),
        "found_from": found.scans[0], "scans": found.scans[1], "tuned_on": _gain(found.on), "held_back": _gain(found.held),
        "level_held_back": _gain(found.level_held), "advice": found.advice, "runs": found.rounds,
    }  # fmt: skip


def _gain(gain: Gain | None) -> dict[str, Any] | None:
    return None if gain is None else gain.data()


def toml(found: ByPlace) -> str:
    """Return the config with what the advice takes: the table, or the one number."""
    head = [
        f"# {toml_text.comment(found.title) or 'A config'}, {found.path} by `vedette tune --detection`.",
        f"# Found from the first {found.scans[0]} of {found.scans[1]} scans.",
    ]
    if found.held is not None:
        head.append(f"# Log-likelihood of the others, table less one number: {found.held.text}.")
    place = (*path_of(found.path), "detection_probability")
    note = "that of the table" if found.advice == "take" else "over all places"
    return text_of(found.own, found.written, {place: f"found: {note}, was {found.before:.4g}"}, head)
