"""What a page takes from the files of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, InputError
from vedette.display import without_passwords
from vedette_files import Origin, Series, Terms
from vedette_files.json_values import read_table
from vedette_files.results import UNFINISHED
from vedette_report.drawing import canvas
from vedette_report.page.columns import columns
from vedette_report.page.frames import frames
from vedette_report.page.geography import graticule, read_underlay
from vedette_report.page.packing import Packed
from vedette_report.page.thinned import read_thinned

SERIES, SMOOTHED = "series.npz", "smoothed.npz"


@final
@frozen(eq=False)
class Shown:
    """A run, or its smoothed tracks: its name, folder, series and figures, the summary in words, and its config.

    `every`: of a long run it has one scan in so many.
    """

    name: str
    folder: Path
    series: Series
    figures: dict[str, Any]
    words: str
    config: str
    every: int = 1

    @classmethod
    def read(cls, path: Path) -> Shown:
        """Read the folder of a run, or series in it, as `smoothed.npz`. InputError if a file is missing."""
        if path.suffix != ".npz" and not path.is_dir():
            there = "is a file" if path.exists() else "there is no such folder"
            raise InputError(f"{path}: {there}; must be the folder that `vedette run` or `vedette study` wrote")
        file = path if path.suffix == ".npz" else path / SERIES
        (series, every), folder = read_thinned(file), file.parent
        if not series.tables:
            raise InputError(f"{file}: is empty: the run was ended before its first complete block")
        figures = read_table(folder / "summary.json") if (folder / "summary.json").exists() else {}
        name = folder.resolve().name
        if file.name == SMOOTHED:
            name, figures = f"{name} (smoothed)", figures.get("smoothed", {})
        config = without_passwords(_text(folder / "config.json"))
        ended = (folder / "summary.txt").exists() or not name.startswith(UNFINISHED)
        words = _text(folder / "summary.txt") if ended else "The run did not come to its end: there are no figures.\n"
        if every > 1:
            words = f"The page shows one scan in {every:,}; the figures are of all.\n\n{words}"
        return cls(name, folder, series, figures, words, config, every)

    def facts(
        self, underlay: Path | None, origin: Origin | None, centre: Array | None = None
    ) -> tuple[dict[str, Any], list[Packed]]:
        """Return what is the same in all of the run, and its packed columns; `centre`: the origin of the page's map."""
        series = self.series
        terms = Terms.of(series.about["notes"])
        origin = origin or terms.origin
        packed, placed = columns(series, centre)
        return {
            **series.about,
            **placed,
            "dated": terms.dated,
            "words": self.words,
            "config": self.config,
            "colours": {"tracks": canvas.TRACKS, "modes": canvas.MODES},
            "frames": frames(self.folder / "recording.jsonl", series["scans"]["time"], self.config, self.every),
            "underlay": [] if underlay is None else read_underlay(underlay, origin),
            "graticule": [] if origin is None else graticule(origin, *_box(series)),
        }, packed

    @property
    def map_axes(self) -> list[str]:
        """The names of the map's axes; none without a map."""
        return list(self.series.about["map"]["axes"]) if self.series.about["map"] else []


def _box(series: Series) -> tuple[Array, Array]:
    """Return the corners of what the series have on the map."""
    places = np.concatenate([series["returns"]["position"], series["truth"]["position"]])
    known = places[np.isfinite(places).all(axis=1)]
    return (known.min(axis=0), known.max(axis=0)) if len(known) else (np.full(2, -1e3), np.full(2, 1e3))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; `vedette run` writes it") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text: {error.reason} at byte {error.start}") from None
