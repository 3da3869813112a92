"""Scans whose numbers stand together in few arrays: one by one they take some 1.1 kB each beside their numbers."""

from __future__ import annotations

from array import array
from collections.abc import Container, Iterable, Sequence
from math import prod
from typing import Any, final

import numpy as np
from attrs import define, field

from vedette import Detections, Indices, Pose, Scan

_OPTIONAL = ("evidence", "noise", "missing", "identity", "time")
_CODES = {"identity": "q", "missing": "b"}
_Form = tuple[str, int, tuple[str, ...], int, bool]
"""Sensor, axes of a return, which of its optional parts there are, axes of the pose (0: none), has that a velocity."""


@define
class _Alike:
    """Scans of one form: where the returns of each end, and each part of them one after the other."""

    form: _Form
    ends: array[int] = field(factory=lambda: array("q"))
    parts: dict[str, array[Any]] = field(factory=dict)

    def add(self, scan: Scan) -> int:
        """Take a scan; return its number among these."""
        seen, pose = scan.detections, scan.pose
        for name in ("z", "valid", *self.form[2]):
            self._append(name, getattr(seen, name))
        if pose is not None:
            parts = (pose.position, pose.velocity, [pose.heading])
            self._append("pose", np.concatenate([part for part in parts if part is not None]))
        self.ends.append(len(seen.z) + (self.ends[-1] if self.ends else 0))
        return len(self.ends) - 1

    def scan(self, number: int, time: float) -> Scan:
        """Return a scan by its number."""
        sensor, m, names, d, moves = self.form
        start, end = self.ends[number - 1] if number else 0, self.ends[number]
        shapes = {"z": (m,), "noise": (m, m), "missing": (m,)}
        seen = Detections(**{name: self._part(name, start, end, shapes.get(name, ())) for name in ("z", "valid", *names)})
        if not d:
            return Scan(time, sensor, seen)
        row = self._part("pose", number, number + 1, (d * (1 + moves) + 1,))[0]
        return Scan(time, sensor, seen, Pose(row[:d], row[d:-1] if moves else None, float(row[-1])))

    def _append(self, name: str, values: Any) -> None:
        code = "b" if name == "valid" else _CODES.get(name, "d")
        self.parts.setdefault(name, array(code)).frombytes(np.ascontiguousarray(values, dtype=code).tobytes())

    def _part(self, name: str, start: int, end: int, shape: tuple[int, ...]) -> Any:
        kept, size = self.parts[name], prod(shape)
        found = np.array(kept[start * size : end * size], dtype=kept.typecode).reshape(end - start, *shape)
        return found.astype(bool) if kept.typecode == "b" else found


@final
class PackedScans(Sequence[Scan]):
    """Scans in an order that may be changed; each is made anew where it is asked for. One with a frame is kept as it is."""

    def __init__(self, scans: Iterable[Scan] = ()) -> None:
        self._alike = list[_Alike]()
        self._forms, self._whole = dict[_Form, int](), dict[int, Scan]()
        self._times, self._form, self._number = array("d"), array("h"), array("q")
        self._order: Indices | None = None
        for scan in scans:
            self.add(scan)

    def add(self, scan: Scan) -> None:
        """Add a scan of one run as the last one."""
        form, number = -1, len(self._times)
        if scan.frame is not None:
            self._whole[number] = scan
        else:
            seen, pose = scan.detections, scan.pose
            names = tuple(name for name in _OPTIONAL if getattr(seen, name) is not None)
            d, moves = (0, False) if pose is None else (len(pose.position), pose.velocity is not None)
            key = (scan.sensor, seen.z.shape[-1], names, d, moves)
            form = self._forms.setdefault(key, len(self._alike))
            if form == len(self._alike):
                self._alike.append(_Alike(key))
            number = self._alike[form].add(scan)
        self._times.append(scan.time)
        self._form.append(form)
        self._number.append(number)

    def ordered(self, order: Indices) -> PackedScans:
        """Return those scans alone, in this order; the numbers are shared."""
        other = PackedScans()
        other.__dict__.update(self.__dict__)
        other._order = order if self._order is None else self._order[order]
        return other

    def of(self, sensors: Container[str]) -> PackedScans:
        """Return the scans of these sensors alone."""
        known = np.array([alike.form[0] in sensors for alike in self._alike] + [False])[np.array(self._form, dtype=np.intp)]
        known[[i for i, scan in self._whole.items() if scan.sensor in sensors]] = True
        return self.ordered(np.flatnonzero(known if self._order is None else known[self._order]))

    def __len__(self) -> int:
        return len(self._times) if self._order is None else len(self._order)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(len(self))[index])
        i = range(len(self))[index]
        i = i if self._order is None else int(self._order[i])
        form, number = self._form[i], self._number[i]
        return self._whole[number] if form < 0 else self._alike[form].scan(number, self._times[i])
