"""The files of a run's tracks, from its series: a table, JSON lines; a map or Parquet if its recording is like that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Self, TextIO, final

from vedette.space import Space
from vedette_files import PARQUET, Terms, TrackRows, Write, chunks, csv_head, geojson_pieces, jsonl_head, parquet_pieces
from vedette_files.writing import whole_file


@final
class TrackFiles:
    """`tracks.csv` and `tracks.jsonl` in a folder, a map if the recording has latitudes, Parquet if it is.

    They take the rows of all tracks at once or piece by piece. With `grows` the first two have their names from the
    beginning; else, as the others always, once all is written. Of another `stem` there are the first two alone.
    """

    def __init__(
        self,
        folder: Path,
        space: Space,
        notes: Mapping[str, str],
        modes: int,
        terms: Terms | None = None,
        *,
        stem: str = "tracks",
        extra: Sequence[str] = (),
        grows: bool = False,
    ) -> None:
        self._terms, self._stack = Terms.of(notes) if terms is None else terms, ExitStack()
        self._further = list[Write]()
        self.names = [f"{stem}.csv", f"{stem}.jsonl"]
        with ExitStack() as opening:  # what was opened is closed if the next cannot be
            self._csv, self._jsonl = (opening.enter_context(_opened(folder / name, grows=grows)) for name in self.names)
            self._csv.write(csv_head(space, modes, self._terms, extra))
            self._jsonl.write(jsonl_head(space))
            if stem == "tracks" and "latitude" in self._terms.columns(space):
                self._further.append(opening.enter_context(geojson_pieces(folder / "tracks.geojson", self._terms)))
                self.names.append("tracks.geojson")
            if stem == "tracks" and notes.get("table") == PARQUET and find_spec("pyarrow"):
                self._further.append(opening.enter_context(parquet_pieces(folder / "tracks.parquet", space, self._terms)))
                self.names.append("tracks.parquet")
            self._stack = opening.pop_all()

    def write(self, rows: TrackRows) -> None:
        """Write the next rows."""
        for chunk in chunks(rows):
            self._csv.write(chunk.csv(self._terms))
            self._jsonl.write(chunk.jsonl())
        if self._further:
            tracks = rows.tracks()
            for write in self._further:
                write(tracks)
        self._csv.flush()
        self._jsonl.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        return self._stack.__exit__(kind, error, trace)


def _opened(path: Path, *, grows: bool) -> AbstractContextManager[TextIO]:
    return path.open("w", encoding="utf-8", newline="\n") if grows else whole_file(path)
