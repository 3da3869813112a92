"""A study's claims judged over a grid of what its paper leaves unsaid."""

from __future__ import annotations

from functools import partial
from itertools import product

import numpy as np
from attrs import frozen

from vedette import Array, Progress, Reproduction
from vedette_report.findings import Findings, Keep, Place, afresh, over, remark


@frozen(eq=False)
class Marked:
    """The claims at one point of a grid, as arrays of words (c,): texts, verdicts, and what is said of remarks."""

    texts: Array
    verdicts: Array
    why: Array


def survey(study: Reproduction, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
    """Return the study's claims, each with where it holds on the grid of `study.unsaid`; remarks stay as at the first point.

    Each point is judged on `runs` runs from the same `seed`.
    """
    points = [dict(zip(study.unsaid, values, strict=True)) for values in product(*study.unsaid.values())]
    marked = [
        keep(f"grid {' '.join(point.values())}", Marked, partial(_marked, study, point, runs, seed))
        for point in progress(points, "points of the grid")
    ]
    claims = []
    for i, text in enumerate(marked[0].texts.tolist()):
        verdicts = [claim.verdicts[i].item() for claim in marked]
        places = [Place(point, verdict) for point, verdict in zip(points, verdicts, strict=True)]
        said = verdicts[0] == "remark"
        claims.append(remark(text, marked[0].why[i].item()) if said else over(text, places, runs=runs))
    return Findings(study.title, runs, seed, (), tuple(claims))


def _marked(study: Reproduction, point: dict[str, str], runs: int, seed: int) -> Marked:
    claims = study.claims_at(point, runs, seed)
    return Marked(*(np.array([getattr(claim, name) for claim in claims]) for name in ("text", "verdict", "why")))
