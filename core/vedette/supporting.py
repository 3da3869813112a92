"""The supporting roles: cameras, births, lifecycles, preprocessors and sources; commands, pictures and reproductions.

Shapes and rules are those of `vedette.roles`.
"""

from __future__ import annotations

from abc import abstractmethod
from argparse import ArgumentParser, Namespace
from collections.abc import Collection, Mapping
from typing import Any, ClassVar

import numpy as np

from vedette.progress import Progress
from vedette.roles import Component, Estimator, Sensor
from vedette.space import Array, Mask, Space
from vedette.types import Detections, Frame, Gaussian, Newborn, Recording, Review, Scan


class ImagingSensor(Sensor):
    """A camera. It gives no returns: from each frame it derives the information on where the target appears.

    `measure` is the apparent position; `noise` is the least covariance of one frame, the inverse of the information from a
    target that looks as expected. `at` and the state `x` hold the axes of `observes`, for each track (*b, t, n).
    Laws: J is symmetric PSD, and 0 where no pixel is informative; g is the derivative of llr with respect to the apparent
    position at `at`. learn changes nothing but axes without variance.
    """

    conservative: ClassVar[bool] = False
    """Whether J is more than the covariance of g over frames, so that J^-1 g errs less than it says; else they are equal."""

    @abstractmethod
    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Return information J (*b, t, m, m), score g (*b, t, m), and log-likelihood ratio to the background llr (*b, t).

        `x` is the predicted state, around which to look; `at` is the state at which the image is linearised.
        """

    def seek(self, x: Array, cov: Array, frame: Frame) -> Array:
        """Return where to linearise first: (*b, t, n), cov (*b, t, n, n) -> (*b, t, n); by default the expected position."""
        return x

    def learn(self, x: Array, frame: Frame) -> Array:
        """Return `x` after the frame (*b, t, n), its zero-variance axes updated to the frame: amplitude, spread."""
        return x

    def draw_frame(self, x: Array, shape: tuple[int, int], rng: np.random.Generator) -> Array:
        """Return frames of `shape`, (*b, n) -> (*b, h, w) in counts, as it sees targets at x: background and noise included.

        For laws and simulations; no tracker asks for it.
        """
        raise NotImplementedError(f"camera {self.kind!r} draws no frames")

    def clutter(self, z: Array) -> Array:
        """Return 1: the ratio that a frame gives is already relative to its background."""
        return np.ones(())


class Birth(Component):
    """How tracks start: the undetected targets that no track holds yet, and the prior of a track that starts at one.

    Memory: what it knows of targets without a track, attrs values, tuples and arrays; None if it keeps nothing. It calls
    `estimator` for whatever depends on the tracker's filter, so that one kind works with every filter.
    """

    draws: ClassVar[bool] = False
    """Whether it takes numbers from `rng`; otherwise it gets a generator that raises."""
    models_unseen: ClassVar[bool] = False
    """Whether it models targets without a track; otherwise only `given` and `begin` are called."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors whose returns may start tracks; empty: all."""
        return ()

    @property
    def initial_existence(self) -> float | None:
        """The existence with which every track begins; None where it depends on the scan."""
        return None

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Any:
        """Return the memory before the first scan."""
        return None

    def given(self, state: Space, recording: Recording) -> Gaussian | None:
        """Return the tracks that exist before the first scan, a prior (t, n) over `state`; None: there are none."""
        return None

    def predict(self, memory: Any, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Any:
        """Return the memory `dt` later: targets move, appear and disappear undetected."""
        return memory

    def starts_from(self, sensor: str) -> bool:
        """Return whether returns of this sensor may start tracks; by default, whether `sensors` names it, or none."""
        return not self.sensors or sensor in self.sensors

    def reveal(
        self, memory: Any, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
    ) -> tuple[Array | None, Any]:
        """Return the density (k,) of returns from targets without a track, at each return, and what `begin` needs of them.

        The density is in the unit of the clutter density, to which the scores add it; None: not stated.
        """
        return None, memory

    @abstractmethod
    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return the tracks that start at returns of the sensor of that name.

        found: what `reveal` gave, or None. claimed (k,): the probability that a return is from an existing track.
        A scan without returns starts nothing, but raises ValueError if the sensor cannot start tracks.
        """

    def update(
        self, memory: Any, estimator: Estimator[Any], sensor: Sensor, detections: Detections, claimed: Array, p_gate: float
    ) -> Any:
        """Return the memory after a scan, which updates the targets without a track, detected or not.

        claimed (k,): the probability that a return is from an existing track.
        """
        return memory

    def recycle(self, memory: Any, estimator: Estimator[Any], ended: Gaussian, existence: Array) -> Any:
        """Return the memory with what is left of tracks that ended: estimates (t, n), existence (t,)."""
        return memory


class Lifecycle(Component):
    """When tracks are confirmed and when they end, judged by existence probabilities and associations.

    Memory: whatever it keeps per track, attrs values, tuples and arrays, every array leading with (*b, t).
    """

    certain: ClassVar[bool] = False
    """Whether every track counts as existing, and is reviewed by its hits alone: existence is always 1."""

    permanent: ClassVar[bool] = False
    """Whether every track is certain, confirmed and permanent, whatever is detected: then `review` need not be called."""

    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "from_returns"}
    """The birth used where a config names none."""

    @property
    def needs_spread(self) -> bool:
        """Whether `review` uses the uncertainty of the positions."""
        return False

    @property
    def needs_place(self) -> bool:
        """Whether `review` uses the positions in the plane."""
        return False

    @property
    def least_existence(self) -> float:
        """The existence below which a track ends that was not below from its beginning."""
        return 0.0

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
    """A step between raw returns and the tracker: it makes the scan of one of the tracker's sensors from what its own
    sensors reported at the same time. A conversion of coordinates, a fusion of several sensors.

    Laws: what it makes is over `measurement`, finite, each noise positive definite; padding changes nothing.
    """

    takes_incomplete: ClassVar[bool] = False
    """Whether it takes returns that lack a component, as `missing` states, `z` being nan there. Those that it passes on bear
    `missing`, too. Without it they are left out before it, and told as refused.
    """

    @property
    @abstractmethod
    def sensors(self) -> Mapping[str, Sensor]:
        """The sensors whose scans it takes, by the names in the scans."""

    @property
    @abstractmethod
    def measurement(self) -> Space:
        """The measurement space of its output: that of the tracker's sensor whose scans these are."""

    @abstractmethod
    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Return detections (*b, k, m) from the scans of one time, by sensor, of those that reported."""


class Source(Component):
    """Where scans come from: a recording or a simulated scene. `draws`: whether the scans depend on the generator."""

    draws: ClassVar[bool] = True

    @abstractmethod
    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans for the tracker's sensors.

        InputError for input that is unreadable as a whole, ConfigError with places in this component; bad parts are refused.
        """


class Command(Component):
    """A command of the command line: `vedette KIND`.

    The docstring's first line stands in `vedette --help`, all of it in `vedette KIND --help`.
    `options` is asked of every command at each start, so what `run` alone needs is imported there.
    """

    def options(self, parser: ArgumentParser) -> None:
        """Add the options and arguments that the command takes; by default none."""

    @abstractmethod
    def run(self, arguments: Namespace) -> int:
        """Do it and return the exit code, 0 if all went well. A VedetteError is told in a line, and ends with 2."""


class Picture(Component):
    """A picture that every run leaves in its folder, or that a report is drawn as; `kind` names its file."""

    of: ClassVar[str] = "run"
    """What it is drawn of: a "run" is given as its `Result`; whoever draws another report names it."""

    @abstractmethod
    def draw(self, subject: Any) -> Any:
        """Return a figure of matplotlib, or None if this subject has no such picture."""


class Reproduction(Component):
    """A published study, reproduced: its scenario, its filters as configs, its figures, and verdicts on its claims.

    What it finds is plain data, `vedette_report.findings`. Laws: the same runs and seed give the same, to the last bit.
    """

    title: ClassVar[str]
    """The paper."""
    default_runs: ClassVar[int]
    """Default number of Monte Carlo runs."""
    full_runs: ClassVar[int]
    """Number of runs of `--full`, which may take as long as it needs."""
    elements: ClassVar[tuple[Any, ...]] = ()
    """All that the paper has, each an `Element`: its equations, tables, figures and statements."""
    unsaid: ClassVar[Mapping[str, Collection[str]]] = {}
    """What the paper leaves open, and the values, as said, over whose grid the claims can be judged; none: no grid."""
    grid_runs: ClassVar[int] = 0
    """Default number of runs at each point of the grid."""

    @abstractmethod
    def run(self, runs: int, seed: int, progress: Progress, keep: Any = ...) -> Any:
        """Run the whole study and return its `Findings`.

        `progress` wraps its loops, `keep` (a `Keep`) its long parts, so that an interrupted one can go on.
        """

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> Any:
        """Return the claims with their verdicts at a point of the grid, name to value; always the same claims in order."""
        raise NotImplementedError(f"the study {self.kind!r} has no grid: its `unsaid` is empty")
