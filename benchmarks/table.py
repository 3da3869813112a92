"""What was measured, as text and in Markdown."""

from __future__ import annotations

from itertools import pairwise
from math import floor, log, log10
from pathlib import Path

from benchmarks.footprint import Footprint
from benchmarks.plan import (
    BATCHES,
    CHUNKED,
    EARLIER_LIMIT,
    EARLIER_MARGIN,
    ESTIMATOR,
    FILTERPY,
    FOREIGN,
    FRAMEWORK_MOST,
    FUSED,
    LIMIT,
    NAMES,
    NUMPY_STAGED,
    NUMPY_STEP,
    ONLINE,
    SIMDKALMAN,
    STAGED,
    STEP,
    STONESOUP,
    TARGETS,
    TEXTBOOK,
    Entry,
    Heat,
    framework,
)
from benchmarks.race import Race, Spread

ONLINE_COLUMNS = (STEP, ESTIMATOR, STAGED, FUSED, NUMPY_STEP, TEXTBOOK, FILTERPY, STONESOUP, LIMIT)
BATCH_COLUMNS = (STEP, STAGED, CHUNKED, FUSED, NUMPY_STAGED, TEXTBOOK, SIMDKALMAN, LIMIT)
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def digits(value: float) -> str:
    """Format three significant digits, without exponent."""
    decimals = max(0, 2 - floor(log10(abs(value)))) if value else 0
    return f"{round(value, 2 - floor(log10(abs(value)))) if value else 0:,.{decimals}f}"


def micro(seconds: float) -> str:
    return digits(1e6 * seconds)


def quotient(value: float) -> str:
    """Format 2.4 as it is, 0.05 as 1/20."""
    return digits(value) if value >= 1 else f"1/{digits(1 / value)}"


def spread(ratio: Spread) -> str:
    return f"{quotient(ratio.middle)} ({quotient(ratio.low)} to {quotient(ratio.high)})"


def grid(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown, with figures to the right."""
    line = ["---"] + ["---:"] * (len(head) - 1)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, line, *rows])


def verdict(met: bool) -> str:
    return "met" if met else "**missed**"


def targets(races: dict[str, Race]) -> str:
    """Return every target of which both sides ran."""
    rows = []
    for target in TARGETS:
        if ratio := target.ratio(races):
            what = f"{target.title}: {NAMES[target.entry]} / {NAMES[target.base]}"
            rows.append([what, spread(ratio), quotient(target.most), verdict(ratio.middle <= target.most)])
    if beside := framework(races):
        measured = f"{micro(beside.middle)} us ({micro(beside.low)} to {micro(beside.high)})"
        most = f"{micro(FRAMEWORK_MOST)} us"
        rows.append(
            [f"{FOREIGN.title}: Vedette's own time a stage", measured, most, verdict(beside.middle <= FRAMEWORK_MOST)]
        )
    for title, figure in EARLIER_LIMIT.items():
        if (race := races.get(title)) and (now := race.seconds(LIMIT)):
            ratio = Spread(*(value * 1e6 / figure for value in (now.middle, now.low, now.high)))
            what = f"{title}: C limit / an earlier one's {figure} us"
            rows.append([what, spread(ratio), digits(EARLIER_MARGIN), verdict(ratio.middle <= EARLIER_MARGIN)])
    return grid(["what / what", "measured (quartiles)", "at most", ""], rows) if rows else ""


def times(heats: tuple[Heat, ...], columns: tuple[Entry, ...], races: dict[str, Race]) -> str:
    """Return medians in us, one heat per row; columns that nobody ran are left out."""
    ran = [heat for heat in heats if heat.title in races]
    kept = [entry for entry in columns if any(entry in races[heat.title].each for heat in ran)]
    rows = []
    for heat in ran:
        found = [races[heat.title].seconds(entry) for entry in kept]
        rows.append([heat.title, *("" if one is None else micro(one.middle) for one in found)])
    return grid(["us", *(NAMES[entry] for entry in kept)], rows) if rows else ""


def stages(races: dict[str, Race]) -> str:
    """Return the third party's sensor: each stage, and the sensor's own functions."""
    if (race := races.get(FOREIGN.title)) is None:
        return ""
    found = {entry: race.seconds(entry) for entry in FOREIGN.entries}
    return grid([FOREIGN.title, "us"], [[NAMES[entry], micro(one.middle)] for entry, one in found.items() if one])


def growth(found: dict[str, tuple[Entry, dict[int, float]]]) -> str:
    """Return time against what grows, and the power with which it grows from one value to the next."""
    blocks = []
    for what, (entry, seconds) in found.items():
        values = sorted(seconds)
        powers = [""] + [f"{log(seconds[b] / seconds[a]) / log(b / a):.2f}" for a, b in pairwise(values)]
        rows = [[f"{NAMES[entry]}, us", *(micro(seconds[v]) for v in values)], ["power", *powers]]
        blocks.append(grid([what, *(f"{v:,}" for v in values)], rows))
    return "\n\n".join(blocks)


def footprint(found: Footprint) -> str:
    """Return import time and memory."""
    rows = [[name, spread(ratio)] for name, ratio in found.imports.items()]
    times = grid(["CPU time of a process that imports", f"of numpy's {1e3 * found.numpy_seconds.middle:.0f} ms"], rows)
    held = [[n, digits(mb), digits(found.batch[n]) if n in found.batch else ""] for n, mb in found.imported.items()]
    return times + "\n\n" + grid(["MB held", "imported", "KF, 100,000 tracks, 4 steps: at most"], held)


def report(
    machine: str,
    races: dict[str, Race],
    grown: dict[str, tuple[Entry, dict[int, float]]],
    light: Footprint | None,
    told: list[str],
) -> str:
    """Return the whole report."""
    sections = {
        "": machine + "\n\n" + "\n".join(f"- {line}" for line in told),
        "### Targets\n\n": targets(races),
        "### Online: a scan\n\n": times(ONLINE, ONLINE_COLUMNS, races),
        "### Batches: a track and step\n\n": times(BATCHES, BATCH_COLUMNS, races),
        "### A third party's sensor\n\n": stages(races),
        "### Growth\n\n": growth(grown),
        "### Import and memory\n\n": footprint(light) if light else "",
    }
    return "\n\n".join(head + body for head, body in sections.items() if body)


def write(text: str, page: Path, begin: str = BEGIN, end: str = END) -> None:
    """Put `text` between the markers of a page."""
    before, _, rest = page.read_text().partition(begin)
    page.write_text(f"{before}{begin}\n\n{text}\n\n{end}{rest.partition(end)[2]}")
