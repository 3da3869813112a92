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


def text(fit: ByPlace) -> str:
    """Return the table, a row for each range, and the verdict of the scans held back."""
    return "\n".join(_lines(fit))


def _lines(fit: ByPlace) -> Iterator[str]:
    table = fit.table
    yield from (f"LOOKS WRONG: {said}" for said in fit.odd)
    one, all_of = fit.scans
    yield f"{fit.path}: detection probability {fit.level:.3g} over all, was {fit.before:.3g}; {fit.rounds} runs"
    if np.ptp(table.probability) > 0:
        heads = ["from, m"] + [f"{float(np.degrees(each)):.0f} deg" for each in table.bearings]
        if len(table.bearings) == 1:
            heads[1] = "all around"
        rows = [heads]
        for distance, line, errors in zip(table.ranges.tolist(), table.probability, fit.error, strict=True):
            cells = [f"{p:.2f} +- {error:.2f}" for p, error in zip(line.tolist(), errors.tolist(), strict=True)]
            rows.append([f"{distance:g}", *cells])
        widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
        yield from ("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
        if fit.on is not None:
            yield f"log-likelihood of the {one} scans it was found from, table less one number: {fit.on.text}"
        if fit.held is not None:
            yield f"log-likelihood of the scans held back, table less one number: {fit.held.text}"
    else:
        yield "no place differs: stretches of the recording do not foretell one another better by place"
    if fit.level_held is not None:
        yield f"log-likelihood of the scans held back, one number less the config's own: {fit.level_held.text}"
    yield "take the table" if fit.advice == "take" else f"keep one number: {_why(fit)}"
    if all_of == one:
        yield "no scans were held back, so nothing judges it"


def _why(fit: ByPlace) -> str:
    return "nothing differs" if not np.ptp(fit.table.probability) else "on the scans held back the table is no better"


def data(fit: ByPlace) -> dict[str, Any]:
    """Return all figures as plain data."""
    table = fit.table
    return {
        "title": fit.title, "sensor": fit.path, "warnings": list(fit.odd), "before": fit.before,
        "level": fit.level, "ranges_m": table.ranges.tolist(), "bearings_rad": table.bearings.tolist(),
        "probability": table.probability.tolist(), "error": fit.error.tolist(), "trials": fit.trials.tolist(),
        "found_from": fit.scans[0], "scans": fit.scans[1], "tuned_on": _gain(fit.on), "held_back": _gain(fit.held),
        "level_held_back": _gain(fit.level_held), "advice": fit.advice, "runs": fit.rounds,
    }  # fmt: skip


def _gain(gain: Gain | None) -> dict[str, Any] | None:
    return None if gain is None else gain.data()


def toml(fit: ByPlace) -> str:
    """Return the config with what the advice takes: the table, or the one number."""
    head = [
        f"# {toml_text.comment(fit.title) or 'A config'}, {fit.path} by `vedette tune --detection`.",
        f"# Found from the first {fit.scans[0]} of {fit.scans[1]} scans.",
    ]
    if fit.held is not None:
        head.append(f"# Log-likelihood of the others, table less one number: {fit.held.text}.")
    place = (*path_of(fit.path), "detection_probability")
    note = "that of the table" if fit.advice == "take" else "over all places"
    return text_of(fit.own, fit.written, {place: f"found: {note}, was {fit.before:.4g}"}, head)
