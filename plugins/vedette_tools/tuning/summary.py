"""What a tuning found, in words, in a table and as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from vedette_report.detector_errors.in_tracks import Told
from vedette_tools.tuning.errors import JUMPS
from vedette_tools.tuning.innovations import Noise
from vedette_tools.tuning.tuner import Found, Tuned

PULL = 2.0
"""A log-likelihood that grows by more over one standard error of a value wants another value: by chance it grows by 1."""


def text(tuned: Tuned) -> str:
    """Return the table of parameters, the verdict of the scans held back, and what Q and R are at fault of."""
    return "\n".join(_lines(tuned))


def data(tuned: Tuned) -> dict[str, Any]:
    """Return all figures as plain data."""
    judged = tuned.judged
    return {
        "title": tuned.title,
        "warnings": list(tuned.odd),
        "thresholds": tuned.kept,
        "by": tuned.by,
        "parameters": [parameter.data() for parameter in tuned.parameters],
        "correlation": [[None if np.isnan(one) else one for one in row] for row in tuned.correlation.tolist()],
        "not_told": list(tuned.blurred),
        "tuned_on": None if judged.on is None else judged.on.data(),
        "held_back": None if judged.held is None else judged.held.data(),
        "advice": judged.advice,
        "held_back_grows_by": judged.pull.tolist(),
        "innovations_before": [noise.data() for noise in judged.noises_before],
        "innovations_after": [noise.data() for noise in judged.noises_after],
        "errors_in_time": [told.data() for told in tuned.errors],
        "jumps": tuned.jumps,
        "starts": tuned.starts,
        "ended_at_the_best": tuned.ends,
        "went_on": tuned.onward,
    }


def summary(parameter: Found) -> str:
    """Return one parameter's value and error in words."""
    unit = "" if parameter.free.place.unit == "1" else f" {parameter.free.place.unit}"
    if parameter.error is None:
        return f"{parameter.after:.3g}{unit}, {parameter.told}"
    return f"{parameter.after:.3g} +- {parameter.error:.2g}{unit}"


def _lines(tuned: Tuned) -> Iterator[str]:
    judged = tuned.judged
    yield from (f"LOOKS WRONG: {said}" for said in tuned.odd)
    if tuned.kept:
        yield f"NOTE: {tuned.kept}"
    rows = [("parameter", "before", "after", "error", "95 % within", "")]
    for parameter in tuned.parameters:
        unit = "" if parameter.free.place.unit == "1" else f" {parameter.free.place.unit}"
        within = "" if parameter.interval is None else f"{parameter.interval[0]:.3g} to {parameter.interval[1]:.3g}{unit}"
        error = "-" if parameter.error is None else f"{parameter.error:.2g}"
        before = "-" if parameter.before is None else f"{parameter.before:.4g}"
        rows.append(
            (parameter.free.path, before, f"{parameter.after:.4g}", error, within, parameter.told or _off(parameter))
        )
    widths = [max(len(row[i]) for row in rows) for i in range(6)]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
    yield ""
    for other in tuned.blurred:
        yield f"the data do not determine {other}"
    for i, j, r in _tied(tuned):
        yield f"errors of {tuned.parameters[i].free.path} and {tuned.parameters[j].free.path} correlate by {r:+.2f}"
    if tuned.jumps > JUMPS:
        jumps = f"near its maximum the criterion jumps by up to {tuned.jumps:.1f}"
        yield f"{jumps}, as tracks start or end there; the errors allow for that"
    if judged.on is not None:
        yield f"log-likelihood of the scans tuned on: {judged.on.text}"
    if judged.held is not None:
        yield f"log-likelihood of the scans held back: {judged.held.text}: {_verdict(tuned)}"
        yield from _causes(tuned)
    if judged.on is None:
        yield "the config's own values cannot run over the whole recording, so nothing is compared with them"
    off = any("times too" in _off(parameter) for parameter in tuned.parameters)
    yield from _noises(judged.noises_before, judged.noises_after, off)
    for told in tuned.errors:
        yield from told.text.splitlines()
        if told.compared.wins:
            yield from _proposal(told)
    if tuned.onward:
        again = "once" if tuned.onward == 1 else f"{tuned.onward} times"
        yield f"the search went on {again} from a better point, far from where it had ended: take more --starts"
    yield f"{tuned.ends} of {tuned.starts} searches ended at this maximum; {tuned.evaluations} runs of the tracker" + (
        f", {tuned.resumed} kept from before" if tuned.resumed else ""
    )


def _proposal(told: Told) -> Iterator[str]:
    """Yield how to write a correlated error into a config."""
    correlated, own = told.compared.correlated, f"error_{told.sensor}_{told.axis}"
    size, tau, white = (float(f"{value:.3g}") for value in (correlated.correlated, correlated.tau, correlated.white))
    yield f"  propose: sensors.{told.sensor}, with an own error of {white:g} {told.unit} along {told.axis}, as `of` in"
    yield f'  kind = "biased", add = {{ {told.axis} = "{own}" }}, spread = {{ {own} = {size:g} }}; and beside the motion,'
    yield '  in a "product",'
    unit = "" if told.unit == "m" else f', unit = "{told.unit}"'
    yield f'  kind = "gauss_markov", axes = ["{own}"], sigma = {size:g}, tau = {tau:g}{unit}'


def _off(parameter: Found) -> str:
    """Say by how much a value was off, if that is more than chance."""
    if parameter.before is None or parameter.before <= 0 or parameter.interval is None or parameter.free.scale == "linear":
        return ""
    if parameter.interval[0] <= parameter.before <= parameter.interval[1]:
        return "as it was, within its error"
    if parameter.free.scale == "logit":
        return "was too small" if parameter.after > parameter.before else "was too large"
    ratio = parameter.after / parameter.before
    return f"was {ratio:.2g} times too small" if ratio > 1 else f"was {1 / ratio:.2g} times too large"


def _tied(tuned: Tuned) -> Iterator[tuple[int, int, float]]:
    for i in range(len(tuned.parameters)):
        for j in range(i):
            if abs(tuned.correlation[i, j]) > 0.8:
                yield j, i, float(tuned.correlation[i, j])


def _verdict(tuned: Tuned) -> str:
    held = tuned.judged.held
    assert held is not None
    if held.difference > 2 * held.error:
        return "better there, too"
    if tuned.judged.advice == "keep":
        return f"lower there, by {-held.difference / held.by_scans:.1f} times the error of the scans"
    return "no worse there than chance allows" if held.difference < 0 else "no better there than chance allows"


def _causes(tuned: Tuned) -> Iterator[str]:
    """Yield the advice to keep the values before, what the scans held back want instead, and what that may come from."""
    judged = tuned.judged
    if judged.advice != "keep" or judged.on is None or judged.held is None:
        return
    yield "  keep the values you had: on scans that they were not tuned on, the tuned ones are worse"
    wanted = sorted(zip(judged.pull.tolist(), tuned.parameters, strict=True), key=lambda one: -abs(one[0]))
    for pull, parameter in wanted:
        if abs(pull) > PULL:
            way = "larger" if pull > 0 else "smaller"
            yield f"  those scans favour a {way} {parameter.free.path}: one standard error {way} gains {abs(pull):.1f}"
    if judged.held.difference > -2 * judged.held.error:
        yield "  a loss of this size is within what the errors of the tuned values allow: these are not known well"
    yield "  either the values are overfitted: the scans tuned on are too few for so many parameters"
    yield "  or the two parts differ, for example in the targets or in their turns: then no values suit both"
    total = judged.on.difference + judged.held.difference
    yield f"  over all scans they gain {total:+.1f}; --part 1 tunes on all, and truth or another recording decides"


def _noises(before: Sequence[Noise], after: Sequence[Noise], off: bool) -> Iterator[str]:
    """Yield the innovations' size and correlation by sensor and axis, before and after, and what they say of Q and R.

    `off`: values were found to be wrong. Where innovations showed nothing of it, the text says why that may be.
    """
    later = {(noise.sensor, noise.axis): noise for noise in after}
    for noise in before or after:
        then = later.get((noise.sensor, noise.axis))
        yield f"innovations of {noise.sensor} along {noise.axis}; a NIS of 1 is right:"
        for when, one in (("before", noise if before else None), ("after", then)):
            if one is not None:
                hint = one.hint or "neither Q nor R stands out"
                if off and when == "before" and not one.hint:
                    hint = (
                        f"nothing stands out in the {one.count:.0f} returns of tracks; a track lost and begun anew hides it"
                    )
                yield f"  {when}: NIS {one.nis:.2f}, correlation {one.whiteness:+.2f}: {hint}"
