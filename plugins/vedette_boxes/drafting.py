"""A config for detections of the MOTChallenge's format."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from vedette import Array, Indices, InputError, load
from vedette_boxes.calibration import confused, fitted, of_targets
from vedette_boxes.fitting import Guess, likeliest
from vedette_boxes.rows import BoxRows, numbers_of, overlap, read_rows
from vedette_boxes.sources.mot import sequence_info
from vedette_files.input_files import lines

NOT_TOLD = {"calibration": "", "classes": "", "identity": ""}
MOST_CLASSES = 100
LOOK = 20
"""So many lines tell the format."""
LINKED, HELD = 0.3, 0.99
"""Overlap from which on boxes of two frames are of one object, as SORT has it; the part of their errors that a normal of the
stated deviation holds. By the median, as by likelihood, errors are half as large, and the tail, of arms that swing, begins
tracks anew: on two recorded films.
"""

TEXT = """# A draft for {name}: {boxes} boxes in {frames} frames of {width:g} x {height:g} px, {rate:g} a second{rate_from}
#
#   vedette run THIS.toml

title = {title}
seed = 1

[source]
kind = "mot"
path = {path}
{truth}rate = {rate:g}
{classes}{calibration}
[sensors.camera]
kind = "box"
sigma_place = {place:.3g}  # in parts of a side: all but one box in a hundred err less than 2.6 times that
sigma_size = {size:.3g}
detection_probability = {detected:.2g}  # {detected_from}
clutter_per_scan = {false:.2g}
image = [{width:g}, {height:g}]
sizes = [{least:.3g}, {most:.3g}]  # sides of boxes: none else is detected

[estimator]
kind = "intermittent"  # who is behind somebody else is missed many times in a row, and comes back
in_sight = {in_sight:.3g}  # s; by the likelihood of the first frames, as are all without another word
hidden = {hidden:.3g}

[estimator.of]
kind = "ekf"

[estimator.of.motion]
kind = "box_velocity"
sigma_accel = {accel:.3g}
sigma_growth = {growth:.3g}

[gate]
probability = 0.999

[associator]
kind = "jpda"

{identity}[birth]
kind = "from_returns"
spread = {{ vx = {speed:.3g}, vy = {speed:.3g} }}  # px/s: a height a second

[lifecycle]
kind = "existence"
lifetime = 10.0
confirm = 0.999  # with .95 false boxes were tracks
max_out_of_coverage = 1.0

[judge]
cover_radius = {near:.3g}  # px, as all that is told of points here; box_hota, box_mota and box_idf1 go by overlap
gospa_cutoff = {near:.3g}
{gap}"""


def draft(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Return a config for a file of detections; None for any other."""
    if wishes or not _is_one(path):
        return None
    rows, info = read_rows(path), sequence_info(path)
    true = _truth_of(path)
    corner = rows.box[:, :2] + 0.5 * rows.box[:, 2:]
    width, height = (
        _number(info, name) or float(np.ceil(np.max(corner[:, i]))) for i, name in enumerate(("imWidth", "imHeight"))
    )
    rate, frames = _number(info, "frameRate") or 30.0, int(np.ptp(rows.frame)) + 1
    told = _facts(rows, None if true is None else read_rows(true), frames)
    usual = float(np.median(rows.box[:, 3]))
    place, size = _noise(rows)
    unknown = {name: told.pop(name) for name in ("detected", "false")} if true is None else {}
    first = Guess(**unknown)

    def text(guess: Guess) -> str:
        return TEXT.format(
            name=path.name, boxes=len(rows.frame), frames=frames, width=width, height=height, rate=rate,
            rate_from="" if _number(info, "frameRate") else ": that is assumed, change it",
            title=json.dumps(f"Boxes of {path.name}"), path=json.dumps(str(path)),
            truth=f"truth = {json.dumps(str(true))}\n" if true else "",
            gap=f"truth_gap = {1.5 / rate:.3g}  # s: where the truth leaves frames out, nothing is judged\n" if true else "",
            least=0.9 * float(np.min(rows.box[:, 2:])), most=1.1 * float(np.max(rows.box[:, 2:])),
            speed=usual, near=usual / 2, place=place, size=size, **told, **guess.numbers,
        )  # fmt: skip

    scans = tuple(load(tomllib.loads(text(first))).steps().recording.scans)
    return text(likeliest(first, text, scans if true is None else scans[: frames // 2]))


def _is_one(path: Path) -> bool:
    if not path.is_file() or path.suffix not in (".txt", ".csv"):
        return False
    read = 0
    try:
        for number, line in lines(path):
            if line.strip():
                numbers_of(line)
                read += 1
            if number == LOOK:
                break
    except (InputError, ValueError):
        return False
    return read > 0


def _truth_of(path: Path) -> Path | None:
    """Return the true boxes beside the detections, as the MOTChallenge places them."""
    places = (path.parent / "gt.txt", path.parent.parent / "gt" / "gt.txt")
    return next((place for place in places if place.is_file() and place != path), None)


def _number(info: Mapping[str, str], name: str) -> float | None:
    try:
        value = float(info[name])
    except (KeyError, ValueError):
        return None
    return value if 0 < value < 1e6 else None


def _noise(rows: BoxRows) -> tuple[float, float]:
    """Return the errors of middle and sides, as parts of the sides, by second differences of boxes that overlap.

    A second difference of three errors has 6 times their variance; motion adds to it, little from frame to frame.
    """
    seconds = list[Array]()
    frames = {int(number): rows.box[rows.frame == number] for number in np.unique(rows.frame)}
    for number, now in frames.items():
        before, after = frames.get(number - 1), frames.get(number + 1)
        if before is None or after is None:
            continue
        one, other = overlap(now, before), overlap(now, after)
        both = (one.max(axis=1) >= LINKED) & (other.max(axis=1) >= LINKED)
        second = before[one.argmax(axis=1)] - 2 * now + after[other.argmax(axis=1)]
        seconds.append((second / np.tile(now[:, 2:], 2))[both])
    if not sum(map(len, seconds)):
        return 0.05, 0.1
    most = np.quantile(np.abs(np.concatenate(seconds)), HELD, axis=0) / (NormalDist().inv_cdf(0.5 + 0.5 * HELD) * np.sqrt(6))
    return float(np.clip(most[:2].mean(), 0.005, 0.5)), float(np.clip(most[2:].mean(), 0.005, 0.5))


def _facts(rows: BoxRows, true: BoxRows | None, frames: int) -> dict[str, Any]:
    """Return P_D, false boxes and calibration, by the first half of the true boxes if there are any."""
    if true is None:
        guess = "without true boxes by the likelihood, too, as is the number of false ones"
        return {"detected": 0.8, "false": max(0.1 * len(rows.frame) / frames, 0.1), "detected_from": guess, **NOT_TOLD}
    half = rows.frame[0] + frames // 2
    early, real = rows.of(rows.frame < half), true.of((true.frame < half) & (true.score != 0))
    which = of_targets(early, real)
    target, calibration = which >= 0, ""
    if np.all((early.score >= 0) & (early.score <= 1)):
        try:
            fit = fitted(early.score, target)
            numbers = f"slope = {fit.slope:.4g}, offset = {fit.offset:.4g}"
            calibration = f"calibration = {{ {numbers} }}  # of scores, by the first half of the true boxes\n"
        except ValueError:
            pass
    return {
        "detected": float(np.clip(np.count_nonzero(target) / max(len(real.frame), 1), 0.05, 0.99)),
        "false": max(np.count_nonzero(~target) / max(frames // 2, 1), 0.01),
        "detected_from": "by the first half of the true boxes, as is the number of false ones",
        "calibration": calibration,
        **_classes(early, real, which),
    }


def _classes(rows: BoxRows, real: BoxRows, which: Indices) -> dict[str, str]:
    """Return what classes the detector names and confuses; nothing if it names one or none."""
    classes = int(np.max(rows.kind, initial=0))
    target = which >= 0
    if not 2 <= classes <= MOST_CLASSES or not np.all((real.kind >= 1) & (real.kind <= classes)):
        return {"classes": "", "identity": ""}
    table = confused(rows.kind[target], real.kind[which[target]], classes)
    share = np.bincount(real.kind - 1, minlength=classes) + 1.0
    false = np.bincount(np.maximum(rows.kind[~target] - 1, 0), minlength=classes) + 1.0
    lines_of = {"confusion": table, "share": share / share.sum(), "false_share": false / false.sum()}
    text = "".join(f"{name} = {json.dumps(_rounded(values))}\n" for name, values in lines_of.items())
    head = "[identity]  # by the first half of the true boxes: of each class a row, how it is named; how common they are\n"
    return {"classes": "classes = true\n", "identity": f"{head}{text}\n"}


def _rounded(values: Array) -> Any:
    """Return probabilities with four digits whose sums are 1."""
    rounded = np.round(values, 4)
    rounded[..., -1] += 1.0 - np.sum(rounded, axis=-1)
    return np.round(rounded, 4).tolist()
