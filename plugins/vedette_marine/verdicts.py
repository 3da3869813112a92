"""What the paper on IMM-PDAF with a marine radar claims, judged by the figures of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vedette_marine.outcome import COAST, FILTERS, PUBLISHED, Found, kept, ratio
from vedette_report.findings import Cell, Claim, Condition, judged, remark, rms_cell, share_cell

Figures = Mapping[tuple[str, ...], Cell]
IMM, CV, CT = FILTERS
PAIRS = ((IMM, CV), (IMM, CT), (CV, CT))
BOATS, SHIPS = "MANV", "DARC"
STABLE = 20.0
"""In % of the tracks: so few may be lost by a filter that tracks stably."""
BETTER = 0.96
"""IMM-PDAF's error over that of CV-PDAF where targets manoeuvre."""
SIZE = 0.25
"""In parts of a published error: errors so near are of its size."""


def figures(found: Found, numbered: Found, late: Found | None = None) -> dict[tuple[str, ...], Cell]:
    """Return the figures that the claims are judged by: errors in m, lost tracks in %.

    `numbered` are timed by frame number, `late` after an initial coast.
    """
    made: dict[tuple[str, ...], Cell] = {}
    tuned = {target: records for (target, parameters), records in found.items() if parameters == "tuned"}
    for target, records in tuned.items():
        printed = dict(zip(FILTERS, PUBLISHED.get(target, (None,) * 3), strict=True))
        for one, other in PAIRS:
            was = [printed[name] for name in (one, other)]
            over = None if None in was else was[0] / was[1]  # type: ignore[operator]
            for what in ("ais", "centre"):
                made[what, target, one, other] = ratio(records, other, what, one, over if what == "ais" else None)
        made["error", target] = rms_cell(kept(records[IMM], "ais"), printed[IMM])
    for scene in (BOATS, SHIPS):
        for name in FILTERS:
            lost = [records[name].lost for target, records in tuned.items() if target.startswith(scene)]
            made["lost", scene, name] = share_cell(np.stack(lost, axis=-1), scale=100) if lost else Cell(None)
    if late:
        made["late lost",] = share_cell(np.stack([records[IMM].lost for records in late.values()], axis=-1), scale=100)
    for (target, _), records in (late or {}).items():
        for one, other in PAIRS:
            made["late", target, one, other] = ratio(records, other, "ais", one)
    for (target, _), records in numbered.items():
        made["by number", target] = rms_cell(kept(records[IMM], "ais"), PUBLISHED[target][0])
    return made


def claims(cells: Figures, runs: int, *, pictures: bool = False) -> tuple[Claim, ...]:
    """Return the claims with their verdicts, over so many runs, on returns from `pictures` or drawn ones."""
    targets = [key[1] for key in cells if key[0] == "error"]
    boats, ships = ([target for target in targets if target.startswith(scene)] for scene in (BOATS, SHIPS))

    def against(what: str, target: str, one: str, other: str, most: float, strict: bool = False) -> Condition:
        against = "AIS" if what == "ais" else "the hull's centre"
        words = f"{target}: RMSE of {one} over that of {other}, against {against}"
        return Condition(words, cells[what, target, one, other], most=most, strict=strict)

    def stable(scene: str) -> Condition:
        return Condition(f"{scene}-like: tracks that {IMM} loses, %", cells["lost", scene, IMM], most=STABLE)

    return (
        judged(
            "IMM-PDAF is more accurate than CV-PDAF where targets manoeuvre (table 4, MANV)",
            [
                *(against(what, target, IMM, CV, BETTER) for target in boats for what in ("ais", "centre")),
                *(Condition(f"{target}: RMSE of {IMM}, m", cells["error", target], most=10.0) for target in boats),
                stable(BOATS),
            ],
            runs,
            "the process noise of CV-PDAF is the best of a grid, on runs of its own",
        ),
        _over_ct(
            cells, boats, [*(against("ais", each, IMM, CT, 1.0, True) for each in boats), stable(BOATS)], runs, pictures
        ),
        judged(
            "IMM-PDAF is more accurate than CV-PDAF on the large ship, 423 m against 525 m (table 4, DARC)",
            [against("ais", target, IMM, CV, 0.98) for target in ships],
            runs,
            "what is seen is not the antenna, 65 m from the hull's centre, and that is the same for all filters. Against "
            f"the hull's centre the ratio is {_several(cells, ships, 'centre', IMM, CV)}",
        ),
        judged(
            "The errors are in the order IMM, CV, CT for all three targets (table 4)",
            [against("ais", target, one, other, 1.0, True) for target in targets for one, other in ((IMM, CV), (CV, CT))],
            runs,
            "a CT-PDAF that estimates its turn rate follows turning boats better than a CV-PDAF",
        ),
        judged(
            "IMM-PDAF tracks the targets stably in clutter (section 3.2, figure 7 c, d)",
            [stable(scene) for scene, some in ((BOATS, boats), (SHIPS, ships)) if some],
            runs,
        ),
        judged(
            "Errors of 98 to 117 m (MANV) and of 423 m (DARC) with IMM-PDAF (table 4)",
            [_size("RMSE", cells["error", target], target) for target in targets],
            runs,
            "the recordings can be had from the DLR (Fowdur and others, Sensors 21(14), 4641, 2021) and are not at hand. "
            f"{_by_number(cells)}",
        ),
        *_late(cells, runs),
        remark(
            "A gate of 13.074 has a probability of .99 (table 6)",
            f"in two axes it has {1 - math.exp(-13.074 / 2):.5f}, and 9.2103 has .99; no number of axes up to 6 gives it",
        ),
        remark(
            "The run times of the three hardly differ (table 5)",
            "they depend on the machine, and the paper's hold its picture chain; ours stand beside them above",
        ),
    )


def _over_ct(cells: Figures, boats: list[str], conditions: list[Condition], runs: int, pictures: bool) -> Claim:
    text = "IMM-PDAF is more accurate than CT-PDAF where targets manoeuvre (table 4, MANV)"
    tuned = "the process noise of CT-PDAF is the best of a grid, on runs of its own"
    if pictures:
        return judged(text, conditions, runs, tuned)
    return remark(
        text,
        "the paper's returns are from pictures, and `marine-pictures` judges it there. On returns drawn without the bias "
        f"of an echo's middle its RMSE is {_several(cells, boats, 'ais', IMM, CT)} times that of CT-PDAF; {tuned}",
    )


def _late(cells: Figures, runs: int) -> tuple[Claim, ...]:
    """Return what is claimed of a track that begins before its first return."""
    if ("late lost",) not in cells:
        return ()
    boats = list(dict.fromkeys(key[1] for key in cells if key[0] == "late" and key[1].startswith(BOATS)))
    order = ", ".join(f"{one[:3]}/{other[:2]} {_several(cells, boats, 'late', one, other)}" for one, other in PAIRS)
    return (
        judged(
            "A track that begins before its first return is predicted until one comes, and then follows (figure 7 d)",
            [Condition(f"tracks that {IMM} loses, %", cells["late lost",], most=STABLE)],
            runs,
            f"{COAST:g} s without returns, parameters of table 6 corrected. The ratios of RMSE against AIS are then, on the "
            f"boats, {order}: such a coast alone does not make the published order. One of 90 s, into the boats' first "
            "turns, loses all of them, with errors of hundreds of metres",
        ),
    )


def _size(what: str, cell: Cell, target: str) -> Condition:
    printed = PUBLISHED[target][0]
    return Condition(f"{target}: {what} of {IMM}, m", cell, round((1 - SIZE) * printed, 1), round((1 + SIZE) * printed, 1))


def _by_number(cells: Figures) -> str:
    """Say what a frame's number taken for its time makes of the errors, and where that is not what was published."""
    numbered = {key[1]: cell for key, cell in cells.items() if key[0] == "by number"}
    if not numbered:
        return "Healthy tracks err by far less"
    parts = []
    for target, cell in numbered.items():
        near = cell.measured is not None and abs(cell.measured / PUBLISHED[target][0] - 1) <= SIZE
        parts.append(f"{_told(cell)} m on the {target}, {'of' if near else 'not of'} the published size")
    return f"With a frame's number taken for its time (frames are lost) the errors are {'; '.join(parts)}"


def _several(cells: Figures, targets: list[str], what: str, one: str, other: str) -> str:
    return " and ".join(_told(cells[what, target, one, other], 3) for target in targets)


def _told(cell: Cell, digits: int = 0) -> str:
    """Return a figure in words; one that does not exist, as all runs were lost, is unknown."""
    return "unknown" if cell.measured is None else f"{cell.measured:.{digits}f}"
