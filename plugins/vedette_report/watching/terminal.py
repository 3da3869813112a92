"""A run in the terminal while it goes: a map of characters and the tracks, by rich."""

from __future__ import annotations

from time import monotonic, time
from typing import Any, final

import numpy as np

from vedette import Array, ConfigError, Experiment, Gaussian, Scan
from vedette.experiment import Steps
from vedette.tracking import State
from vedette_files import Tables
from vedette_report.map.plane import Plane, positions_of
from vedette_report.watching.real_time import Pace

COLOURS = ("cyan", "yellow", "green", "magenta", "blue", "red", "bright_cyan", "bright_yellow", "bright_green")
"""Of tracks, by their numbers."""

_PER_SECOND = 8
"""Pictures: what comes between two of them is drawn with the next."""

_MARGIN = 0.05
"""Of the map's width, around what it shows."""


@final
class TerminalView:
    """Shows a run in the terminal: `take` is told of each scan, as `Experiment.finish` tells it, and draws some of them."""

    def __init__(self, experiment: Experiment, steps: Steps, pace: Pace, console: Any = None) -> None:
        try:
            from rich.console import Console
            from rich.live import Live
        except ImportError:
            raise ConfigError.at("--terminal", "needs rich: pip install 'vedette[report]'") from None
        self._experiment, self._pace = experiment, pace
        space = experiment.tracker.state
        self._plane = Plane.of(space, steps.recording) if len(space) > 1 else None
        self._unit = space.axes[0].unit if self._plane is None else self._plane.axes[0].unit
        self.scans, self._begin = 0, monotonic()
        self._last: tuple[Scan, State, Gaussian] | None = None
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)
        self.console = Console() if console is None else console
        self._live = Live(get_renderable=self._picture, console=self.console, refresh_per_second=_PER_SECOND)
        self._live.start()

    def take(
        self, scan: Scan, before: State, state: State, estimate: Gaussian, modes: Array | None, told: Tables | None = None
    ) -> None:
        """Note a scan and the state after it; the next picture shows it."""
        self.scans += 1
        self._last = scan, state, estimate

    def end(self, *, interrupted: bool, wait: float = 0.0) -> None:
        """Draw the last scan and leave it on the screen."""
        self._live.stop()
        if not self.console.is_terminal:
            self.console.print()

    def _picture(self) -> Any:
        from rich.console import Group
        from rich.text import Text

        if self._last is None:
            return Text("no scan yet", style="dim")
        scan, state, estimate = self._last
        took = max(monotonic() - self._begin, 1e-9)
        head = (
            f"{self._experiment.title or 'vedette watch'}\n{scan.time:.2f} s, scan {self.scans} of {scan.sensor}, "
            f"{len(scan.detections.z)} returns, {np.count_nonzero(state.confirmed)} confirmed tracks, "
            f"{self.scans / took:.3g} scans/s, {max(time() - self._pace.came, 0.0):.2g} s since it came"
        )
        parts = [Text(head, style="bold")]
        if self._plane is not None:
            parts.append(self._map(scan, state, estimate, self._plane))
        return Group(*parts, self._table(state, estimate))

    def _map(self, scan: Scan, state: State, estimate: Gaussian, plane: Plane) -> Any:
        """Return what the scan and the tracks are on the map, a dot a return, and of a track its number."""
        from rich.text import Text

        space, sensor = self._experiment.tracker.state, self._experiment.tracker.sensors[scan.sensor]
        tracks = plane.points(space, estimate.mean)[state.confirmed]
        returns = positions_of(scan, sensor, plane)
        width, height = max(self.console.width - 2, 20), max(self.console.height // 2, 8)
        self._extend(np.concatenate([tracks, returns]))
        cells = [[(" ", "")] * width for _ in range(height)]
        span = np.maximum(self._high - self._low, 1e-9) * (1 + 2 * _MARGIN)
        steps = span / (width, height)  # of a character: the whole width is used, so the two scales differ
        middle = (self._low + self._high) / 2 if np.isfinite(self._low).all() else np.zeros(2)
        down = self._unit == "px"
        marks = [*((spot, "\N{MIDDLE DOT}", "dim") for spot in returns)]
        marks += [
            (spot, str(number), f"bold {COLOURS[number % len(COLOURS)]}")
            for spot, number in zip(tracks, state.ids[state.confirmed].tolist(), strict=True)
        ]
        for spot, mark, style in marks:
            if np.isfinite(spot).all() and np.isfinite(steps).all():
                right, up = (spot - middle) / steps
                column, row = int(width / 2 + right), int(height / 2 + (up if down else -up))
                if 0 <= column < width and 0 <= row < height:
                    for i, letter in enumerate(mark[: width - column]):
                        cells[row][column + i] = (letter, style)
        text = Text(no_wrap=True)
        for line in cells:
            for mark, style in line:
                text.append(mark, style=style)
            text.append("\n")
        text.append(
            f"{steps[0] * 10:.4g} {self._unit} for 10 characters, {steps[1] * 10:.4g} {self._unit} for 10 lines", style="dim"
        )
        return text

    def _extend(self, spots: Array) -> None:
        """Let the map hold these places (k, 2), too."""
        known = spots[np.isfinite(spots).all(axis=1)]
        if len(known):
            self._low = np.minimum(self._low, known.min(axis=0))
            self._high = np.maximum(self._high, known.max(axis=0))

    def _table(self, state: State, estimate: Gaussian) -> Any:
        from rich.table import Table

        space, rows = self._experiment.tracker.state, np.flatnonzero(state.confirmed)
        table = Table(box=None, pad_edge=False)
        table.add_column("track", justify="right")
        for axis in space.axes[:6]:
            table.add_column(f"{axis.name} [{axis.unit}]", justify="right")
        table.add_column("existence", justify="right")
        most = max(self.console.height - max(self.console.height // 2, 8) - 6, 3)
        for row in rows[:most].tolist():
            number = int(state.ids[row])
            cells = [f"{value:.5g}" for value in estimate.mean[row, :6].tolist()]
            table.add_row(str(number), *cells, f"{state.existence[row]:.3f}", style=COLOURS[number % len(COLOURS)])
        if len(rows) > most:
            table.caption = f"and {len(rows) - most} more"
        return table
