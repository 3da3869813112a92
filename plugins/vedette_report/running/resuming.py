"""Going on from a streamed run that did not come to its end.

Beside its series the run keeps the tracker's state after the last scan that they hold. A new run takes the source's scans
up to there, plays what the series say of them to the judge and the writers instead of tracking them, and goes on from that
state: its files are, byte for byte, those of a run that nobody ended. docs/adr/0035 says why nothing else is kept.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from shlex import quote
from typing import Any, final

import numpy as np
from attrs import evolve, field, frozen

from vedette import ConfigError, Experiment, InputError, Problem, Scan, Space, to_config
from vedette.experiment import Steps
from vedette.tracking import without_bad_returns
from vedette.types import come_once
from vedette_files import Tables, open_series, scan_line
from vedette_files.input_files import lines, whole_text
from vedette_files.json_values import parse, read_table
from vedette_files.results import CHECKPOINT, unfinished_runs
from vedette_files.writing import write_text
from vedette_report.identity import Code, check, tell
from vedette_report.running.files import SERIES
from vedette_report.running.lagging import SMOOTHED_SERIES, SmoothedFiles

FORMAT, VERSION = "vedette checkpoint", 1
"""Of a checkpoint, which holds two lines: what the second one is, with its hash, and the state."""

RECORDING = "recording.jsonl"

ScanTables = dict[str, dict[str, Any]]
"""Tables of one scan."""


@final
class Checkpoints:
    """Writes the state of a streamed run into its place, whenever its series are written up to there."""

    def __init__(self, place: Path, experiment: Experiment, smoothed: SmoothedFiles | None = None) -> None:
        self._path, self._experiment, self._smoothed = place / CHECKPOINT, experiment, smoothed
        self._made: dict[str, str] | None = None
        self._refused = False

    def write(self, steps: Steps, scans: int) -> None:
        """Keep the state after so many scans that were taken; or once, why it cannot be kept."""
        if self._refused:
            return
        self._made = Code.of([to_config(self._experiment)]).made if self._made is None else self._made
        told = {"scans": scans, "drawn": steps.drawn, "seconds": steps.seconds, "code": self._made}
        try:
            told |= {"state": steps.state.to_data(), "intake": steps.intake.to_data()}
            told |= {"smoothed": None if self._smoothed is None else self._smoothed.to_data()}
        except TypeError as error:
            self._refused, told = True, {"refused": str(error)}
        content = json.dumps(told)
        head = {"format": FORMAT, "version": VERSION, "sha256": sha256(content.encode()).hexdigest()}
        write_text(self._path, f"{json.dumps(head)}\n{content}\n")


@final
@frozen(eq=False)
class Former:
    """A run that did not come to its end: its place, the scans that were taken and drawn up to the state that it kept.

    smoothed: what `SmoothedFiles.to_data` says of a run that smooths. `beside`: other places of runs of the same config that
    came less far.
    """

    place: Path
    config: dict[str, Any]
    scans: int = 0
    drawn: int = 0
    seconds: float = 0.0
    code: Mapping[str, str] = field(factory=dict)
    state: Any = None
    intake: Any = None
    smoothed: Any = None
    beside: tuple[Path, ...] = ()

    @property
    def lag(self) -> float | None:
        """The lag with which it smooths, in s; None: it does not."""
        return None if self.smoothed is None else float(self.smoothed["lag"])

    @classmethod
    def of(cls, folder: Path) -> Former:
        """Return the run in a folder to go on from: the one that came farthest. ConfigError if there is none.

        InputError if what it kept was altered, or if it keeps a state that cannot be written.
        """
        places = unfinished_runs(folder)
        if not places:
            raise ConfigError.at("--resume", f"{str(folder)!r} holds no run that did not come to its end")
        streamed = [place for place in places if (place / CHECKPOINT).exists()]
        if not streamed:
            told = f"{places[-1]} has nothing to go on from, as a run that keeps all writes at its end: run it again"
            raise ConfigError.at("--resume", told)
        runs = [_read(place) for place in streamed]
        best = max(runs, key=lambda run: run.scans)
        return evolve(best, beside=tuple(run.place for run in runs if run is not best and run.config == best.config))

    def check(self, experiment: Experiment, *, accept: bool) -> None:
        """Raise ConfigError if a run is of another config, or of other code that is not accepted."""
        if other := list(_differences(self.config, json.loads(json.dumps(to_config(experiment))))):
            raise ConfigError(Problem(place, f"must be {was}, as in {self.place}, got {now}") for place, was, now in other)
        if self.drawn:
            tell(check(self.code, Code.of([self.config]).made, str(self.place), accept=accept))

    def play(
        self, steps: Steps, head: Iterable[str], spaces: Mapping[str, Space], none: Tables
    ) -> Iterator[tuple[Scan, ScanTables]]:
        """Yield the scans that were taken, each with its rows of the tables `none`, and then let `steps` go on after them.

        `head`: the lines of the recording before its scans. InputError if the series or the recording are damaged, or if the
        source gives other scans than it gave.
        """
        if not self.drawn:
            return
        if come_once(steps.recording.scans):
            raise InputError(f"{self.place}: its source gives each scan once, so that nobody can go on from there")
        given = lines(self.place / RECORDING)
        for wanted in head:
            self._check_line(wanted.rstrip("\n"), next(given, (0, "")))
        with open_series(self.place / SERIES) as series:
            rows, taken = _by_scan(series.blocks(), none), 0
            line = next(given, (0, ""))
            for scan in steps.skip(self.drawn):
                kept = _as_recorded(scan, line[1], spaces) if taken < self.scans else None
                if kept is None:  # it was refused whole
                    continue
                row = next(rows, None)
                if row is None or row["scans"]["time"][0] != scan.time:
                    raise ValueError(f"it has no scan {taken} at {scan.time} s, which the recording beside it has")
                taken, line = taken + 1, next(given, (0, ""))
                yield kept, row
        if taken < self.scans:
            self._check_line("", line)
        steps.go_on(self.state, self.intake, self.seconds)

    def smoothed_rows(self, none: Tables) -> Iterator[ScanTables]:
        """Yield the rows of the tables `none` of each scan that it smoothed."""
        if self.drawn:
            with open_series(self.place / SMOOTHED_SERIES) as series:
                yield from _by_scan(series.blocks(), none)

    def _check_line(self, wanted: str, line: tuple[int, str]) -> None:
        if line[1] != wanted:
            raise InputError(f"{self.place / RECORDING}:{line[0]}: the source does not give what it gave to this run")


def not_ended(folder: Path) -> str:
    """Return in words that the run in a folder did not end, and what finishes it; "" if none is there."""
    left = unfinished_runs(folder)
    if not left:
        return ""
    streamed = any((place / CHECKPOINT).exists() for place in left)
    finishes = f"`vedette run --resume {quote(str(folder))}` finishes it"
    cure = finishes if streamed else "as it writes all at its end, run it again"
    return f"the run in {str(folder)!r} did not end: {cure}"


def _read(place: Path) -> Former:
    """Return what a place holds; InputError if it was altered."""
    config, path = read_table(place / "config.json"), place / CHECKPOINT
    if not path.exists():
        return Former(place, config)
    try:
        head, content, end = whole_text(path).split("\n")
        told = parse(head)
        if not isinstance(told, dict) or (told.get("format"), told.get("version")) != (FORMAT, VERSION) or end:
            raise ValueError(f"must be {FORMAT!r} of version {VERSION}, got {head[:80]}; run it anew, without --resume")
        if sha256(content.encode()).hexdigest() != told.get("sha256"):
            raise ValueError("was altered: its hash is another")
        kept = parse(content)
        if "refused" in kept:
            raise InputError(f"{place}: its state cannot be written, so nobody can go on from there: {kept['refused']}")
        numbers = int(kept["scans"]), int(kept["drawn"]), float(kept["seconds"])
        return Former(place, config, *numbers, dict(kept["code"]), kept["state"], kept["intake"], kept.get("smoothed"))
    except InputError:
        raise
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path}: {error}") from None


def _as_recorded(scan: Scan, line: str, spaces: Mapping[str, Space]) -> Scan | None:
    """Return a scan as the line of a recording has it, which may lack bad returns; None if it is none of the scan."""
    if scan.frame is not None:
        document = json.loads(line or "{}")
        document.pop("frame", None)
        line = json.dumps(document)
    for taken in (_whole, without_bad_returns):
        kept, _ = taken(scan)
        try:
            if scan_line(evolve(kept, frame=None), spaces) == f"{line}\n":
                return kept
        except ValueError:  # not finite
            continue
    return None


def _whole(scan: Scan) -> tuple[Scan, list[Problem]]:
    return scan, []


def _by_scan(blocks: Iterable[Tables], none: Tables) -> Iterator[ScanTables]:
    """Yield the rows of each scan, of the tables and columns that `none` has, counted from the scan's own begin.

    ValueError if they have other columns.
    """
    scans = entries = 0
    for block in blocks:
        tables = {table: {name: block[table][name] for name in columns} for table, columns in none.items()}
        for table, columns in none.items():
            for name, wanted in columns.items():
                column = tables[table][name]
                if column.dtype != wanted.dtype or column.shape[1:] != wanted.shape[1:]:
                    raise ValueError(f"{table}.{name} must be of {wanted.dtype} {wanted.shape[1:]}")
        count = len(tables["scans"]["time"])
        edges = {table: np.arange(count + 1) for table in ("scans",)}
        for table in ("returns", "entries", "splits", "merges"):
            edges[table] = np.searchsorted(tables[table]["scan"], scans + np.arange(count + 1))
        for table in ("weights", "below"):
            edges[table] = np.searchsorted(tables[table]["entry"], entries + edges["entries"])
        spans = {table: list(pairwise(ends.tolist())) for table, ends in edges.items()}
        for i in range(count):
            rows = {table: {name: part[slice(*spans[table][i])] for name, part in tables[table].items()} for table in tables}
            for table in ("returns", "entries", "splits", "merges"):
                rows[table]["scan"] = rows[table]["scan"] - np.int32(scans + i)
            first = entries + spans["entries"][i][0]
            for table in ("weights", "below"):
                rows[table]["entry"] = rows[table]["entry"] - first
            yield rows
        scans, entries = scans + count, entries + int(edges["entries"][-1])


def _differences(was: Any, now: Any, place: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield the places where two configs differ, and what stands there."""
    if isinstance(was, dict) and isinstance(now, dict):
        for name in sorted(was.keys() | now.keys()):
            yield from _differences(was.get(name), now.get(name), f"{place}.{name}".removeprefix("."))
    elif was != now:
        yield place, json.dumps(was)[:60], json.dumps(now)[:60]
