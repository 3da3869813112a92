"""Detections of the MOTChallenge's format."""

from __future__ import annotations

from collections.abc import Mapping
from configparser import ConfigParser, Error
from pathlib import Path
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import ConfigError, Detections, InputError, Recording, Rows, Scan, Sensor, Source, Trajectory, fields
from vedette_boxes.calibration import Calibration
from vedette_boxes.rows import BoxRows, read_rows
from vedette_boxes.sensors.box import BOX
from vedette_files.input_files import whole_text
from vedette_files.readers import find

WANTED = "det.txt: `frame, id, left, top, width, height, score` a line"


@final
@frozen
class MotSource(Source):
    """Boxes that a detector found in the frames of a camera, frame by frame, the frames without any included.

    Coordinates are in px, as the file has them: the middle of a box is left + width / 2. Frame n is at the time n / rate. A
    score becomes evidence by `calibration`. True boxes whose 7th number is 0 do not count, as in the MOTChallenge; between
    two frames in which an object is annotated it is taken to be there.
    Milan, Leal-Taixe, Reid, Roth, Schindler, MOT16: A Benchmark for Multi-Object Tracking, arXiv:1603.00831, 2016.
    """

    kind: ClassVar[str] = "mot"
    draws: ClassVar[bool] = False

    path: str = fields.text("the detections", default="")
    truth: str = fields.text("the true boxes; default: there are none", default="")
    rate: float = fields.quantity("1/s", "frames a second", default=30.0, above=0)
    frames: int = fields.integer("number of frames; default: up to the last one with a box", default=0)
    least_score: float = fields.quantity("1", "boxes with a lower score are left out", default=-1e9)
    classes: bool = fields.flag(
        "take the 8th number, from 1 on, as a class, which `identity.confusion` of the tracker weighs", default=False
    )
    calibration: Calibration | None = fields.part("what a score says; default: nothing", default=None)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return a scan a frame. InputError for a file without boxes, ConfigError for sensors that measure none."""
        names = [name for name, sensor in sensors.items() if sensor.measurement == BOX]
        if len(names) != 1:
            raise ConfigError.at("", f"needs one sensor that measures {BOX}, the tracker has {len(names)}")
        path = find(self.path, WANTED)
        found = read_rows(path)
        kept = found.of(found.score >= self.least_score)
        true = read_rows(find(self.truth, "gt.txt: true boxes")) if self.truth else None
        if self.calibration is not None and not np.all((kept.score >= 0) & (kept.score <= 1)):
            raise InputError(f"{path}: scores must be from 0 to 1, if `calibration` is to weigh them")
        last = max(int(rows.frame[-1]) for rows in (found, true) if rows is not None)
        numbers = range(int(found.frame[0] == 0) ^ 1, (self.frames or last) + 1)
        edges = np.searchsorted(kept.frame, [*numbers, numbers.stop])
        scans = tuple(
            Scan(number / self.rate, names[0], self._detections(kept, slice(begin, end)))
            for number, begin, end in zip(numbers, edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        )
        total = len(found.frame) + len(found.refused)
        return Recording(
            scans,
            truth=() if true is None else self._trajectories(true),
            refused=(*found.refused, *(() if true is None else true.refused)),
            rows={
                "lines": Rows(
                    total, int(edges[-1] - edges[0]), len(found.refused), len(found.frame) - int(edges[-1] - edges[0])
                )
            },
        )

    def _detections(self, rows: BoxRows, part: slice) -> Detections:
        evidence = None if self.calibration is None else self.calibration.evidence(rows.score[part])
        named = np.maximum(rows.kind[part] - 1, -1) if self.classes else None
        return Detections(rows.box[part], np.ones(len(rows.box[part]), dtype=bool), evidence=evidence, identity=named)

    def _trajectories(self, rows: BoxRows) -> tuple[Trajectory, ...]:
        counted = rows.of(rows.score != 0)
        return tuple(
            Trajectory(str(number), BOX, counted.frame[own] / self.rate, counted.box[own])
            for number in np.unique(counted.id)
            for own in (np.flatnonzero(counted.id == number),)
        )


def sequence_info(path: Path) -> Mapping[str, str]:
    """Return what `seqinfo.ini` beside the detections, or a folder above, says of them; nothing without one."""
    for folder in (path.parent, path.parent.parent):
        info = folder / "seqinfo.ini"
        if info.is_file():
            parser = ConfigParser()
            parser.optionxform = str  # type: ignore[assignment,method-assign]  # names are written with capitals
            try:
                parser.read_string(whole_text(info))
                return dict(parser["Sequence"])
            except (Error, KeyError):
                return {}
    return {}
