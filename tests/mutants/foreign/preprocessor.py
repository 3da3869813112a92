"""Wrong preprocessors."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

SENSORS = {"raw": standard.RangeBearing(5.0, 0.05, x=100.0, y=-50.0)}
NAIVE = partial(standard.NaiveConversion, sensors=SENSORS)
UNBIASED = partial(standard.UnbiasedConversion, sensors=SENSORS)


def _made(**change):
    """Return a `process` that changes what is made: functions of it and of the one sensor's detections."""

    def process(right, scans):
        raw = next(iter(scans.values())).detections
        out = right.process(scans)
        return attrs.evolve(out, **{name: f(right, out, raw) for name, f in change.items()})

    return process


def _given(scan=lambda s: s, **change):
    """Return a `process` that takes scans, or parts of their detections, for others."""

    def process(right, scans):
        changed = {}
        for name, one in scans.items():
            parts = {part: f(getattr(one.detections, part)) for part, f in change.items()}
            changed[name] = scan(attrs.evolve(one, detections=attrs.evolve(one.detections, **parts)))
        return right.process(changed)

    return process


def _polar_noise(right, out, raw):
    return np.broadcast_to(_radar(right).noise(raw.z), out.noise.shape).copy()


def _radar(right):
    return next(iter(right.sensors.values()))


def _shrunk(right, out, raw):
    """The mean is r (cos b, sin b) times the factor by which the unbiased conversion divides."""
    radar = _radar(right)
    station = np.array([radar.x, radar.y])
    return station + (out.z - station) * np.exp(-(radar.sigma_bearing**2))


preprocessor = partial(mutant, "preprocessor")

MUTANTS: tuple[Mutant, ...] = (
    preprocessor(
        "conversion_degrees", "The bearing is taken as degrees.", NAIVE, process=_given(z=lambda z: z * [1.0, np.pi / 180])
    ),
    preprocessor(
        "conversion_from_north",
        "The bearing is taken as a compass bearing.",
        NAIVE,
        process=_given(z=lambda z: z * [1.0, -1.0] + [0.0, np.pi / 2]),
    ),
    preprocessor(
        "conversion_padding",
        "Padding comes out as returns.",
        NAIVE,
        process=_made(valid=lambda right, out, raw: np.ones_like(out.valid)),
    ),
    preprocessor(
        "conversion_nan_padding",
        "Padding comes out as NaN.",
        NAIVE,
        process=_made(z=lambda right, out, raw: np.where(out.valid[..., None], out.z, np.nan)),
    ),
    preprocessor(
        "conversion_polar_noise",
        "The covariance is still that of range and bearing.",
        NAIVE,
        process=_made(noise=_polar_noise),
    ),
    preprocessor(
        "conversion_noise_of_the_first",
        "All returns have the first one's covariance.",
        NAIVE,
        process=_made(noise=lambda right, out, raw: np.repeat(out.noise[..., :1, :, :], out.z.shape[-2], axis=-3)),
    ),
    preprocessor(
        "conversion_singular",
        "The bearing's error is forgotten: the covariance is singular.",
        NAIVE,
        process=_made(noise=lambda right, out, raw: np.einsum("...i,...j->...ij", out.z, out.z) * 1e-4),
    ),
    preprocessor(
        "conversion_own_noise_ignored", "A return's own covariance is ignored.", NAIVE, process=_given(noise=lambda n: None)
    ),
    preprocessor(
        "conversion_swapped",
        "x and y change places, the covariance does not.",
        NAIVE,
        process=_made(z=lambda right, out, raw: out.z[..., ::-1]),
    ),
    preprocessor(
        "conversion_pose_ignored",
        "The platform's pose is ignored.",
        NAIVE,
        process=_given(scan=lambda s: attrs.evolve(s, pose=None)),
    ),
    preprocessor(
        "conversion_loses_last",
        "The last return of every scan is lost.",
        NAIVE,
        process=_given(valid=lambda v: v & (np.arange(v.shape[-1]) < v.shape[-1] - 1)),
    ),
    preprocessor(
        "conversion_other_space", "It says that it makes y, x.", NAIVE, measurement=lambda r: vedette.Space.of(y="m", x="m")
    ),
    preprocessor(
        "unbiased_multiplied",
        "The mean is multiplied by E cos(error), not divided.",
        UNBIASED,
        label="other_model",
        process=_made(z=_shrunk),
    ),
)
