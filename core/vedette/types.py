"""The values that pass through a tracker: frozen, batch axes first, tracks next.

Shapes: `*b` any batch axes (runs), `t` tracks, `k` returns, `n` state axes, `m` measured axes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from vedette import given
from vedette.errors import Problem
from vedette.space import Array, Indices, Mask, Space
from vedette.values import maker


@frozen(eq=False)
class Gaussian:
    """Mean (*b, t, n) and covariance (*b, t, n, n)."""

    mean: Array
    cov: Array


@frozen(eq=False)
class Detections:
    """What one sensor reported in one scan.

    z         (*b, k, m)   over the sensor's measurement space
    valid     (*b, k)      False pads a batch whose runs have different counts
    evidence  (*b, k)      log-likelihood ratio of target to clutter by the detector, given that it reported
    noise     (*b, k, m, m) a return's own covariance; otherwise the sensor's applies
    missing   (*b, k, m)   True where a return lacks a component: its z and noise are ignored
    identity  (*b, k)      the code by which a return names its object, or its class, as an MMSI; -1 or None for none
    time      (k,)         when each was measured, s, until the scan's time; None: all then. In one run, not in lock-step
    """

    z: Array = field(converter=given.z)
    valid: Mask = field(converter=given.valid)
    evidence: Array | None = field(default=None, converter=given.evidence)
    noise: Array | None = field(default=None, converter=given.noise)
    missing: Mask | None = field(default=None, converter=given.missing)
    identity: Indices | None = field(default=None, converter=given.identity)
    time: Array | None = field(default=None, converter=given.times)

    @classmethod
    def of(cls, z: Any, axes: int | None = None) -> Detections:
        """Return all returns of one scan, each valid: `z` (k, m); [] is none, of any number of axes unless that is given."""
        values = given.z(z)
        if values.size == 0:
            values = values.reshape(0, axes or 0)
        return cls(values, np.ones(values.shape[:-1], dtype=bool))

    @property
    def complete(self) -> Mask:
        """Which returns are valid and lack no component (*b, k)."""
        return self.valid if self.missing is None else self.valid & ~np.any(self.missing, axis=-1)

    def noise_of(self, returns: Any) -> Array | None:
        """Return the own covariances of some returns of one run; None if none has its own."""
        return None if self.noise is None else self.noise[returns]


def _as_detections(value: Any) -> Detections:
    """Return the returns that a list or an array of them holds."""
    return value if isinstance(value, Detections) else Detections.of(value)


@frozen(eq=False)
class Frame:
    """One image of a camera: `pixels` (*b, h, w) in counts, row first; a NaN pixel carries no information.

    The pixel in column i and row j covers the unit square around x = i, y = j, in px; x points right and y down. `corner`
    (*b, 2) or (2,): x and y of the first pixel if the image is a window of a larger one; else 0, 0. `geometry` maps
    pixels to positions, as plain data for the preprocessor that reads it. A radar picture in colour is (3, h, w): its
    channels come first, as runs do. A frame is one return, without evidence and with nothing missing.
    """

    evidence: ClassVar[None] = None
    missing: ClassVar[None] = None
    identity: ClassVar[None] = None
    time: ClassVar[None] = None
    pixels: Array = field(converter=given.pixels)
    corner: Array | None = field(default=None, converter=given.corner)
    geometry: Mapping[str, Any] | None = None


@frozen(eq=False)
class Pose:
    """Where a sensor's platform is: position (*b, d) in m, velocity (*b, d) in m/s, heading (*b) in rad.

    The heading turns the measured bearings: measured = true - heading. 0 for a north-stabilised sensor.
    """

    position: Array = field(converter=given.position)
    velocity: Array | None = field(default=None, converter=given.velocity)
    heading: float | Array = field(default=0.0, converter=given.heading)


@frozen(eq=False)
class Scan:
    """One scan of one sensor: time in s, the sensor's name in the tracker, its detections, its pose.

    A camera's scan brings a `frame`, and then no detections.
    """

    time: float = field(converter=given.time)
    sensor: str
    detections: Detections = field(converter=_as_detections)
    pose: Pose | None = None
    frame: Frame | None = None

    @classmethod
    def image(cls, time: float, sensor: str, frame: Frame) -> Scan:
        """Return the scan of a camera with this frame."""
        return cls(time, sensor, Detections.of([], 2), frame=frame)


@frozen(eq=False)
class Innovation:
    """How a scan compares with predicted tracks, before association.

    loglik      (*b, t, 1+k)  column 0: log(1 - P_D P_G); column i: log P_D + log p(z_i | track)
    distance    (*b, t, k)    squared Mahalanobis distance, the least over modes (union gate)
    log_volume  (*b, t)       log sqrt|S|, the largest over modes
    nis         (*b, t, k)    squared distance expected over modes given the return: its mean is m on matched truth
    detail      what the estimator that made it needs for `update`; its arrays lead with (*b, t), too, as some of the tracks
                may be taken from it; what is common to all tracks, such as the scan, is in a `vedette.tracking.Common`
    """

    loglik: Array
    distance: Array
    log_volume: Array
    nis: Array
    detail: Any


@frozen(eq=False)
class Hypotheses:
    """The detail of a Gaussian filter's innovation: shift (*b, t, k, n) of the mean and posterior covariance
    post (*b, t, 1|k, n, n) under each detection.
    """

    shift: Array
    post: Array


@frozen(eq=False)
class Newborn:
    """Tracks that start at returns of a scan: `returns` (j,), their indices in it, the prior (j, n), existence (j,)."""

    returns: NDArray[np.intp]
    prior: Gaussian
    existence: Array

    @staticmethod
    @cache
    def none(axes: int) -> Newborn:
        """Return no tracks, of states of so many axes; its arrays are shared, and empty."""
        return Newborn(np.zeros(0, dtype=np.intp), Gaussian(np.zeros((0, axes)), np.zeros((0, axes, axes))), np.zeros(0))


@frozen(eq=False)
class Mixtures:
    """`count` mixtures of the same beliefs: by `shares` (p,) of the belief `parts` (p,) in the one of row `into` (p,).

    The shares of each sum to 1.
    """

    into: Indices
    parts: Indices
    shares: Array
    count: int


@frozen(eq=False)
class Review:
    """A scan's results for the tracks, for the lifecycle; all (*b, t) but the time.

    dt            time since the last scan, in s
    existence     after the scan
    hit           probability that a return was the track's
    p_detect      probability with which the sensor should have detected it
    awaited       greatest such probability of another sensor that is to look again, as it looked last; None: not asked
    spread        largest standard deviation of its position, in m; None unless the lifecycle needs it
    place         expected x and y (*b, t, 2), in m; None unless the lifecycle needs it
    own           of leaves of hypotheses: existence under their own history, and `existence` is over all; else None
    """

    dt: float
    existence: Array
    hit: Array
    p_detect: Array
    spread: Array | None = None
    place: Array | None = None
    awaited: Array | None = None
    own: Array | None = None


@frozen(eq=False)
class Trajectory:
    """The states of one true object: times (s,) in s, states (s, n) over `space`. Linear in between."""

    name: str
    space: Space
    times: Array
    states: Array

    def at(self, time: float) -> Array | None:
        """Return the state (n,) at `time`, or None outside the recorded span."""
        if not len(self.times) or not self.times[0] <= time <= self.times[-1]:
            return None
        i = int(np.clip(np.searchsorted(self.times, time) - 1, 0, max(len(self.times) - 2, 0)))
        j = min(i + 1, len(self.times) - 1)
        gap = self.times[j] - self.times[i]
        part = 0.0 if gap == 0 else (time - self.times[i]) / gap
        return self.space.displace(self.states[i], part * self.space.difference(self.states[j], self.states[i]))


@frozen(eq=False)
class Track:
    """One track's history in one run: `id` is unique in its tracker. `s` is the number of scans it lived.

    times (s,) s, mean (s, n), cov (s, n, n), confirmed (s,), existence (s,), mode_prob (s, r) or None,
    weights: per scan (1+k,), column 0 the miss; nis (s,) the weighted squared distance, hit (s,) = 1 - weights[0];
    returns: per scan the return (k,) of each further column, or None where they are all of the scan's
    parents: confirmed tracks from which it may have split; merged: when it ended in s, and the track that took its returns
    confirmed_at (s,) s: when it was known that it is confirmed at the scan, NaN if never; None if always at the scan
    identity (s,): the code that it most likely bears, -1 for none; None where no return named its object
    link (s,): the probability that the return which it took and its last before are of one target, NaN without such; None
    where no hypotheses are kept
    """

    id: int
    space: Space
    times: Array
    mean: Array
    cov: Array
    confirmed: Mask
    existence: Array
    mode_prob: Array | None
    weights: tuple[Array, ...]
    nis: Array
    hit: Array
    returns: tuple[Indices | None, ...] | None = None
    parents: tuple[int, ...] = ()
    merged: tuple[float, int] | None = None
    confirmed_at: Array | None = None
    identity: Indices | None = None
    link: Array | None = None


@frozen(eq=False)
class LazyScans(Sequence[Scan]):
    """Scans made on demand, as pictures do not all fit into memory: `make(i)` gives the i-th of `length`, each time anew.

    Those of a camera come `once`, in order: `length` is then the most there can be, and `make` raises IndexError at the end.
    """

    length: int
    make: Callable[[int], Scan]
    once: bool = False

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return tuple(self.make(i) for i in range(self.length)[index])
        return self.make(range(self.length)[index])


def come_once(scans: object) -> bool:
    """Return whether scans are such as come once: how many there will be is not known."""
    return isinstance(scans, LazyScans) and scans.once


@frozen
class Rows:
    """The numbers of rows, lines or frames read: used, refused, or left out because the tracker has no such sensor."""

    total: int
    used: int
    refused: int
    left_out: int = 0


@frozen(eq=False)
class Recording:
    """What a source delivers: scans in time order, the truth if it is known, and what was refused on the way.

    `scans` may be lazy. `warnings`: a sentence for each thing that looks wrong but was read. `rows` counts all that was
    read. `detected`: sensors whose scans a preprocessor has already made, and what they measure; a run uses these scans as
    they are. `starts`: known states of targets at the first scan; tracks are not compared with them. `nobody`: the truth is
    known to hold no object, so that every confirmed track is false.
    """

    scans: Sequence[Scan]
    truth: tuple[Trajectory, ...] = ()
    refused: tuple[Problem, ...] = ()
    notes: Mapping[str, str] = {}
    warnings: tuple[str, ...] = ()
    rows: Mapping[str, Rows] = {}
    detected: Mapping[str, Space] = {}
    starts: tuple[Trajectory, ...] = ()
    nobody: bool = False


new_gaussian = maker(Gaussian)
new_innovation = maker(Innovation)
new_review = maker(Review)
