"""The supporting roles: cameras, where tracks come from and when they end, what prepares scans and where they come from.

Shapes and rules are those of `vedette.roles`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from vedette.roles import Component, Estimator, Sensor
from vedette.space import Array, Mask, Space
from vedette.types import Detections, Frame, Gaussian, Newborn, Recording, Review, Scan


class ImagingSensor(Sensor):
    """A camera. It gives no returns: of each frame it says what the pixels tell about where the target appears.

    `measure` is the apparent position; `noise` that of one frame at best, the inverse of the information in a target that
    looks as expected. `at` and the state `x` hold the axes of `observes`, for each track (*b, t, n).
    Laws: J is symmetric PSD, and 0 where no pixel tells anything; g is the derivative of llr with respect to the apparent
    position at `at`. learn changes nothing but axes without variance.
    """

    @abstractmethod
    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Information J (*b, t, m, m), score g (*b, t, m) and log-likelihood ratio of target to background llr (*b, t).

        `x` is where the target is expected, so where to look; `at` is where the image is linearised.
        """

    def seek(self, x: Array, cov: Array, frame: Frame) -> Array:
        """Where to linearise first: (*b, t, n), cov (*b, t, n, n) -> (*b, t, n); where the target is expected."""
        return x

    def learn(self, x: Array, frame: Frame) -> Array:
        """`x` after the frame (*b, t, n), its zero-variance axes brought up to what the frame shows: amplitude, spread."""
        return x

    def clutter(self, z: Array) -> Array:
        """1: the ratio that a frame gives is relative to its background already."""
        return np.ones(())


class Birth(Component):
    """Where tracks come from: the targets that no track holds yet, and the prior of a track that starts at one of them.

    Memory: what it knows of targets without a track, attrs values, tuples and arrays; None if it keeps nothing. Whatever it
    needs of the tracker's filter it asks of `estimator`, so that one kind serves all of them.
    """

    draws: ClassVar[bool] = False
    """Whether it takes numbers from `rng`: else it is handed one that refuses."""
    models_unseen: ClassVar[bool] = False
    """Whether it keeps a model of targets without a track: else `predict`, `reveal` and `miss` are never asked."""

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Any:
        """Return the memory before the first scan."""
        return None

    def given(self, state: Space, recording: Recording) -> Gaussian | None:
        """Return the tracks that are there before the first scan, a prior (t, n) over `state`; None: there are none."""
        return None

    def predict(self, memory: Any, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Any:
        """Return the memory `dt` later: targets move, go and come without being seen."""
        return memory

    def starts_from(self, sensor: str) -> bool:
        """Return whether returns of the sensor of that name may start tracks."""
        return True

    def reveal(
        self, memory: Any, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
    ) -> tuple[Array | None, Any]:
        """Return the density (k,) with which targets without a track give each return, and whatever `begin` needs of them.

        The density is in the unit of the clutter's, with which it competes in the gate; None: not stated.
        """
        return None, memory

    def miss(self, memory: Any, estimator: Estimator[Any], sensor: Sensor, p_gate: float) -> Any:
        """Return the memory after a scan: the targets without a track that were not detected in it."""
        return memory

    @abstractmethod
    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return the tracks that start at returns of the sensor of that name.

        found: what `reveal` gave, or None. claimed (k,): the probability that a return is of a track that is there already.
        A scan without returns starts nothing, but ValueError says already what keeps the sensor from starting tracks.
        """


class Lifecycle(Component):
    """When tracks count as real and when they end; judged on existence probabilities and on what was associated.

    Memory: whatever it keeps per track, attrs values, tuples and arrays, every array leading with (*b, t).
    """

    certain: ClassVar[bool] = False
    """Whether every track is taken to exist, and judged by its detections alone: existence is 1 throughout."""

    permanent: ClassVar[bool] = False
    """Whether every track is certain, counts as real and goes on, whatever is detected: a tracker then need not ask."""

    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "from_returns"}
    """The birth that goes with it where a config names none."""

    @property
    def needs_spread(self) -> bool:
        """Whether `review` wants to know how far the positions are uncertain."""
        return False

    @abstractmethod
    def start(self, existence: Array) -> Any:
        """Return the memory of tracks that start now, with their existence (t,)."""

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the existence (*b, t) that is expected `dt` later."""
        return existence

    @abstractmethod
    def review(self, memory: Any, scan: Review) -> tuple[Any, Mask, Mask]:
        """Return memory, confirmed (*b, t) and alive (*b, t) after a scan."""


class Preprocessor(Component):
    """What stands between raw returns and the tracker: it makes the scan of one of the tracker's sensors from what its own
    sensors reported at the same moment. A conversion of coordinates, a fusion of several sensors.

    Laws: what it makes is over `measurement`, finite, each noise positive definite; padding changes nothing.
    """

    @property
    @abstractmethod
    def sensors(self) -> Mapping[str, Sensor]:
        """The sensors whose scans it takes, by the names that the scans bear."""

    @property
    @abstractmethod
    def measurement(self) -> Space:
        """The space of what it makes: that of the tracker's sensor whose scans these are."""

    @abstractmethod
    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """The scans of one moment, by sensor, those that came -> (*b, k, m)"""


class Source(Component):
    """Where scans come from: a recording, a simulated scene. `draws`: whether another generator gives other scans."""

    draws: ClassVar[bool] = True

    @abstractmethod
    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """All scans for the tracker's sensors.

        InputError for what is unreadable as a whole, ConfigError with places in this component; bad parts are refused.
        """
