"""SORT, configured as published, against Vedette's config on the boxes of `examples/boxes`.

    python -m benchmarks.sort_boxes [CONFIG ...]

Each config is run as it is; SORT is of our own writing after the paper, with the noises of the authors' published code.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from attrs import define, field
from scipy.optimize import linear_sum_assignment

import vedette
from vedette.space import Array
from vedette_boxes import judge_files, overlap, read_rows, results, write_rows

BOXES = Path(__file__).parent.parent / "examples" / "boxes"
FROM = {"all frames": 0, "second half": 201}
LEAST_OVERLAP, MAX_AGE, MIN_HITS = 0.3, 1, 3
F = np.eye(7) + np.eye(7, k=4)
H = np.eye(4, 7)
R = np.diag([1.0, 1.0, 10.0, 10.0])
P0 = np.diag([10.0, 10.0, 10.0, 10.0, 1e4, 1e4, 1e4])
Q = np.diag([1.0, 1.0, 1.0, 1.0, 0.01, 0.01, 1e-4])


@define
class Sorted:
    """A track: middle, area and aspect of its box and the rates of the first three (7,), with covariance."""

    number: int
    x: Array
    P: Array = field(factory=P0.copy)
    hits: int = 0
    streak: int = 0
    unseen: int = 0

    def predict(self) -> Array:
        """Move by a frame, and return the box."""
        if self.x[2] + self.x[6] <= 0:
            self.x[6] = 0.0
        self.x, self.P = F @ self.x, F @ self.P @ F.T + Q
        if self.unseen > 0:
            self.streak = 0
        self.unseen += 1
        return self.box

    def update(self, box: Array) -> None:
        """Take a detection."""
        self.unseen, self.hits, self.streak = 0, self.hits + 1, self.streak + 1
        S = H @ self.P @ H.T + R
        K = np.linalg.solve(S, H @ self.P).T
        self.x, self.P = self.x + K @ (measured(box) - H @ self.x), (np.eye(7) - K @ H) @ self.P

    @property
    def box(self) -> Array:
        """The middle and the sides."""
        with np.errstate(invalid="ignore"):
            width = np.sqrt(self.x[2] * self.x[3])
            return np.array([self.x[0], self.x[1], width, self.x[2] / width])


def measured(box: Array) -> Array:
    """Return middle, area and aspect of a box."""
    return np.array([box[0], box[1], box[2] * box[3], box[2] / box[3]])


def sort(path: Path) -> Iterator[tuple[int, int, Array, float]]:
    """Track the detections of a file; yield frame, track, box and 1.

    Bewley, Ge, Ott, Ramos, Upcroft, Simple Online and Realtime Tracking, ICIP 2016.
    """
    found = read_rows(path)
    tracks, begun = list[Sorted](), 0
    for count, frame in enumerate(range(1, int(found.frame[-1]) + 1), 1):
        boxes = found.box[found.frame == frame]
        expected = [(track, track.predict()) for track in tracks]
        tracks = [track for track, box in expected if np.all(np.isfinite(box))]
        places = np.array([track.box for track in tracks]).reshape(-1, 4)
        alike = overlap(boxes, places)
        rows, columns = linear_sum_assignment(-alike)
        taken = {i: j for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if alike[i, j] >= LEAST_OVERLAP}
        for i, j in taken.items():
            tracks[j].update(boxes[i])
        for i in set(range(len(boxes))) - set(taken):
            begun += 1
            tracks.append(Sorted(begun, np.append(measured(boxes[i]), np.zeros(3))))
        for track in tracks:
            if track.unseen < 1 and (track.streak >= MIN_HITS or count <= MIN_HITS):
                yield frame, track.number, track.box, 1.0
        tracks = [track for track in tracks if track.unseen <= MAX_AGE]


def main(configs: list[str]) -> None:
    """Print the figures of SORT and of each config."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        files = {"SORT": Path(folder) / "sort.txt"}
        write_rows(files["SORT"], sort(BOXES / "det.txt"))
        table = {("SORT", which): judge_files(BOXES / "gt.txt", files["SORT"], first) for which, first in FROM.items()}
        for config in configs or [str(BOXES.parent / "boxes.toml")]:
            files[config] = Path(folder) / "mot.txt"
            experiment = vedette.load(config)
            results(files[config].parent, experiment, experiment.run())
            for which, first in FROM.items():
                table[config, which] = judge_files(BOXES / "gt.txt", files[config], first)
    for (name, which), figures in table.items():
        print(name, which, *(f"{figure} {value:.4f}" for figure, value in figures.items()))


if __name__ == "__main__":
    main(sys.argv[1:])
