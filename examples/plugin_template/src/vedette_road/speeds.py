"""How fast vehicles were: a command, a figure and a picture, which are a plugin by themselves."""

from pathlib import Path

import numpy as np
from attrs import define, frozen

import vedette
from vedette.metrics import Figure

VEDETTE_CONTRACT = 2


@frozen
class Speeds(vedette.Command):
    """Print the mean speed of each track of a run, in m/s.

    It reads tracks.jsonl, which `vedette run` has left in the run's folder.
    """

    kind = "speeds"

    def options(self, parser):
        parser.add_argument("folder", metavar="RUN_DIR", help="the folder that `vedette run` wrote")

    def run(self, arguments):
        from vedette_files import read_tracks

        for track in read_tracks(Path(arguments.folder) / "tracks.jsonl"):
            print(f"track {track.id}: {speeds(track).mean():.3g} m/s")
        return 0


@frozen
class SpeedsOverTime(vedette.Picture):
    """Speed of each track over time."""

    kind = "speeds"

    def draw(self, subject):
        from matplotlib.figure import Figure

        if not subject.tracks or "speed" not in subject.tracks[0].space:
            return None  # as a run of another motion model
        figure = Figure()
        axes = figure.subplots()
        for track in subject.tracks:
            axes.plot(track.times, speeds(track))
        axes.set(xlabel="time [s]", ylabel="speed [m/s]")
        return figure


@define
class Largest:
    """Takes the judged scans of a run block by block, and keeps the largest error of a covered object."""

    square: float | None = None

    def add(self, block):
        if block.pairs.square.size:
            self.square = np.max(block.pairs.square, initial=self.square or 0.0)

    def value(self):
        return None if self.square is None else float(np.sqrt(self.square))


def speeds(track):
    if "speed" not in track.space:
        raise vedette.InputError(f"track {track.id}: has no axis `speed`, which the motion model `clothoid` gives")
    return track.mean[:, track.space.names.index("speed")]


@vedette.plugin
def vedette_components():
    return [Speeds, SpeedsOverTime]


@vedette.plugin
def vedette_figures():
    return [
        Figure("largest_error_m", "m", "largest position error of a covered object", study="largest_error", start=Largest)
    ]
