"""Which contender runs which heat, and the targets for the ratios."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.race import Case, Race, Spread

Entry = tuple[str, str]
"""A contender and its level."""

STEP, ESTIMATOR, STAGED, FUSED = (("vedette", level) for level in ("step", "estimator", "kernels", "fused"))
CHUNKED = ("vedette", "kernels in chunks")
NUMPY_STEP, NUMPY_STAGED = (("vedette numpy", level) for level in ("step", "kernels"))
TEXTBOOK, FILTERPY, STONESOUP, BY_MATRICES = ("textbook", ""), ("filterpy", ""), ("stonesoup", ""), ("stonesoup", "matrices")
SIMDKALMAN, LIMIT = ("simdkalman", ""), ("limit", "")

NAMES: dict[Entry, str] = {
    STEP: "Vedette, `Tracker.step`",
    ESTIMATOR: "Vedette, estimator's calls",
    STAGED: "Vedette, a kernel a stage",
    CHUNKED: "Vedette, a kernel a stage, 2,000 tracks at a time",
    FUSED: "Vedette, fused kernel",
    NUMPY_STEP: "numpy kernels, `Tracker.step`",
    NUMPY_STAGED: "numpy kernels, a kernel a stage",
    TEXTBOOK: "textbook numpy",
    FILTERPY: "FilterPy",
    STONESOUP: "Stone Soup",
    BY_MATRICES: "Stone Soup, F and Q given",
    SIMDKALMAN: "simdkalman",
    LIMIT: "C limit",
    ("vedette", "predict"): "Vedette, predict alone",
    ("vedette", "evaluate"): "Vedette, evaluate alone",
    ("vedette", "update"): "Vedette, update alone",
    ("vedette", "own"): "the sensor's own functions",
}


@dataclass(frozen=True)
class Heat:
    """A case by its title, and the contenders that run it. `batch`: time is per track and step."""

    title: str
    case: Case
    entries: tuple[Entry, ...]
    batch: bool = False


STAGES = (("vedette", "predict"), ("vedette", "evaluate"), ("vedette", "update"))
ONLINE = (
    Heat("KF", Case("kf"), (STEP, ESTIMATOR, STAGED, FUSED, NUMPY_STEP, TEXTBOOK, FILTERPY, STONESOUP, BY_MATRICES, LIMIT)),
    Heat("EKF, range and bearing", Case("ekf"), (STEP, ESTIMATOR, NUMPY_STEP, TEXTBOOK, FILTERPY, STONESOUP)),
    Heat("UKF, range and bearing", Case("ukf"), (STEP, ESTIMATOR, NUMPY_STEP, TEXTBOOK, FILTERPY, STONESOUP)),
    Heat("IMM, 2 modes", Case("imm", 2), (STEP, ESTIMATOR, STAGED, NUMPY_STEP, TEXTBOOK, FILTERPY)),
    Heat("IMM, 3 modes", Case("imm", 3), (STEP, ESTIMATOR, STAGED, NUMPY_STEP, TEXTBOOK, FILTERPY, LIMIT)),
    Heat("PDA, 8 returns", Case("pda", returns=8), (STEP, NUMPY_STEP, TEXTBOOK, STONESOUP)),
    Heat("IMM-PDAF, 3 modes, 8 returns", Case("imm_pdaf", 3, returns=8), (STEP, STAGED, NUMPY_STEP, TEXTBOOK, LIMIT)),
    Heat("GNN, 50 targets, 93 returns", Case("gnn", 1, 50, 93, 1), (STEP, NUMPY_STEP, TEXTBOOK, STONESOUP)),
    Heat("GNN, 200 targets, 373 returns", Case("gnn", 1, 200, 373, 1), (STEP, NUMPY_STEP, TEXTBOOK, STONESOUP)),
)
FOREIGN = Heat("EKF, a third party's sensor", Case("foreign"), (STEP, ESTIMATOR, *STAGES, ("vedette", "own"), TEXTBOOK))


def _batches(size: int) -> tuple[Heat, ...]:
    steps = 50 if size <= 1000 else 4
    each = (STEP, STAGED, *((CHUNKED,) if size > 2_000 else ()), NUMPY_STAGED, TEXTBOOK)
    return (
        Heat(f"KF, {size:,} tracks", Case("kf", 1, size, 1, steps), (*each, FUSED, SIMDKALMAN, LIMIT), batch=True),
        Heat(f"IMM, 3 modes, {size:,} tracks", Case("imm", 3, size, 1, steps), (*each, LIMIT), batch=True),
        Heat(f"IMM-PDAF, {size:,} tracks", Case("imm_pdaf", 3, size, 8, steps), (*each, LIMIT), batch=True),
    )


POLAR_BATCH = Heat("EKF, 1,000 tracks", Case("ekf", 1, 1_000), (STEP, STAGED, FUSED, TEXTBOOK, LIMIT), batch=True)
BATCHES = (*_batches(32), *_batches(1_000), POLAR_BATCH, *_batches(100_000))


@dataclass(frozen=True)
class Target:
    """In the heat of this title, `entry` takes at most `most` times what `base` takes."""

    title: str
    entry: Entry
    base: Entry
    most: float

    def ratio(self, races: dict[str, Race]) -> Spread | None:
        """Return the measured ratio; None if one of the two did not run."""
        race = races.get(self.title)
        return None if race is None else race.ratio(self.entry, self.base)


BATCH_TARGETS = (("KF", 2.5), ("IMM, 3 modes", 3.0), ("IMM-PDAF", 2.5))
LARGE = ("1,000", "100,000")
TARGETS = (
    Target("KF", STEP, FILTERPY, 1 / 5),
    Target("KF", STEP, STONESOUP, 1 / 60),
    Target("PDA, 8 returns", STEP, STONESOUP, 1 / 60),
    Target("KF", ESTIMATOR, FILTERPY, 1 / 10),
    Target("KF", ESTIMATOR, STONESOUP, 1 / 100),
    Target("IMM, 2 modes", ESTIMATOR, FILTERPY, 1 / 40),
    Target("KF", STAGED, LIMIT, 7),
    Target("KF", FUSED, LIMIT, 4.5),
    Target("IMM, 3 modes", STAGED, LIMIT, 4.5),
    Target("IMM-PDAF, 3 modes, 8 returns", STAGED, LIMIT, 4.5),
    *(Target(f"{name}, {size} tracks", STAGED, LIMIT, most) for size in LARGE for name, most in BATCH_TARGETS),
    *(Target(f"{name}, 100,000 tracks", CHUNKED, LIMIT, most) for name, most in BATCH_TARGETS),
    Target("KF, 100,000 tracks", STEP, LIMIT, 4),
    Target("KF, 100,000 tracks", FUSED, LIMIT, 3),
    Target("EKF, 1,000 tracks", FUSED, LIMIT, 3),
    *(Target(f"KF, {size} tracks", STAGED, SIMDKALMAN, 1 / 10) for size in LARGE),
    *(Target(f"{name}, {size} tracks", STAGED, TEXTBOOK, 1 / 500) for size in LARGE for name, _ in BATCH_TARGETS),
    Target("GNN, 200 targets, 373 returns", STEP, STONESOUP, 1 / 100),
)
FRAMEWORK_STAGES, FRAMEWORK_MOST = 3, 1e-6
"""Stages of an estimator's step, and the most seconds of each that may be Vedette's own beside a third party's sensor."""


def framework(races: dict[str, Race]) -> Spread | None:
    """Return the seconds per stage that are not the sensor's own."""
    each = races[FOREIGN.title].each if FOREIGN.title in races else {}
    if ESTIMATOR not in each or ("vedette", "own") not in each:
        return None
    pairs = zip(each[ESTIMATOR], each["vedette", "own"], strict=False)
    return Spread.of([(whole - own) / FRAMEWORK_STAGES for whole, own in pairs])


EARLIER_LIMIT = {
    "KF": 0.054,
    "IMM, 3 modes": 0.27,
    "IMM-PDAF, 3 modes, 8 returns": 0.30,
    "KF, 1,000 tracks": 0.011,
    "IMM, 3 modes, 1,000 tracks": 0.050,
    "IMM-PDAF, 100,000 tracks": 0.15,
}
"""What another hand-written limit took, in us, on a processor of this kind (Zen 4, AVX-512): a slow limit proves nothing."""
EARLIER_MARGIN = 1.3

# How cost grows: what grows, its values, the case of a value, who is measured.
GROWTH: tuple[tuple[str, tuple[int, ...], str, Entry], ...] = (
    ("targets", (10, 25, 50, 100, 200, 400), "gnn", STEP),
    ("returns", (1, 4, 16, 64), "pda", STEP),
    ("runs in lock-step", (1, 10, 100, 1_000, 10_000), "kf", STEP),
    ("modes", (1, 2, 3, 4, 6), "imm", STEP),
    ("state axes, half of them measured", (2, 4, 6, 8, 12), "kf", STAGED),
)


def grown(what: str, family: str, value: int) -> Case:
    """Return the case of one value."""
    if what == "targets":
        return Case(family, 1, value, round(1.865 * value), 1)
    if what == "returns":
        return Case(family, returns=value)
    if what == "modes":
        return Case(family, value)
    if what.startswith("runs"):
        return Case(family, 1, value, 1, 10)
    return Case(family, axes=value // 2)
