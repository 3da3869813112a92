"""Wrong sensors: what is detected, false returns, what one return says, and where the sensor stands."""

from functools import partial

import attrs
import numpy as np

from mutants.foreign.base import Mutant, mutant
from mutants.foreign.sensor import DOPPLER, POLAR


def _fourth_power(right, x):
    distance = np.linalg.norm(x - [right.x, right.y], axis=-1)
    return right.detection_probability * (1000.0 / np.maximum(distance, 1.0)) ** 4


def _all_in_view(right, x):
    return np.array(right.detection_probability if np.all(right.detects(x) > 0) else 0.0)


def _moved(**change):
    """Return an `at` that changes the pose first."""

    def at(right, pose):
        return right.at(attrs.evolve(pose, **{name: f(getattr(pose, name)) for name, f in change.items()}))

    return at


def _own_axes(right, z, noise=None):
    """Return the covariance along and across the line of sight, not turned into x and y."""
    start = right.invert(z, noise)
    r = z[..., 0]
    variances = np.stack([np.full_like(r, right.sigma_range**2), (r * right.sigma_bearing) ** 2], axis=-1)
    return attrs.evolve(start, cov=variances[..., None] * np.eye(2))


def _first_order(right, z, noise=None):
    start = right.invert(z, noise)
    b = z[..., 1] + right.heading
    mean = np.stack([right.x + z[..., 0] * np.cos(b), right.y + z[..., 0] * np.sin(b)], axis=-1)
    return attrs.evolve(start, mean=mean)


def _known_crossing(right, z, noise=None):
    start = right.invert(z, noise)
    cov = np.array(start.cov)
    cov[..., 2:, :] = cov[..., :, 2:] = 0.0
    return attrs.evolve(start, cov=cov)


sensor = partial(mutant, "sensor")

MUTANTS: tuple[Mutant, ...] = (
    sensor(
        "detects_beyond_range",
        "Targets beyond max_range are detected.",
        POLAR,
        detects=lambda r, x: np.array(r.detection_probability),
    ),
    sensor(
        "detects_more_than_surely", "P_D follows the radar equation, and exceeds 1 nearby.", POLAR, detects=_fourth_power
    ),
    sensor("detects_all_or_none", "One target out of view hides all of them.", POLAR, detects=_all_in_view),
    sensor(
        "clutter_is_a_count",
        "clutter gives the number per scan, not a density.",
        POLAR,
        clutter=lambda r, z: np.full(z.shape[:-1], r.clutter_per_scan),
    ),
    sensor(
        "clutter_per_area",
        "The density is per m^2 of the plane, not per m rad.",
        POLAR,
        clutter=lambda r, z: np.full(z.shape[:-1], r.clutter_per_scan / (np.pi * (r.max_range or 1.0) ** 2)),
    ),
    sensor(
        "clutter_everywhere",
        "The density does not end at max_range: it holds more than all false returns.",
        POLAR,
        clutter=lambda r, z: np.array(r.clutter_per_scan / (2 * np.pi * (r.max_range or 1.0))),
    ),
    sensor(
        "clutter_shares_scan",
        "The density is divided by the number of returns.",
        POLAR,
        clutter=lambda r, z: r.clutter(z) / max(z.shape[-2], 1),
    ),
    sensor(
        "invert_ignores_noise", "A return's own covariance is ignored.", POLAR, invert=lambda r, z, noise=None: r.invert(z)
    ),
    sensor("invert_not_turned", "The covariance stays along and across the line of sight.", POLAR, invert=_own_axes),
    sensor(
        "invert_heading_forgotten",
        "A new track is placed as if the heading were 0.",
        POLAR,
        invert=lambda r, z, noise=None: attrs.evolve(r, heading=0.0).invert(z, noise),
    ),
    sensor(
        "invert_station_forgotten",
        "A new track is placed as if the radar stood at the origin.",
        POLAR,
        invert=lambda r, z, noise=None: attrs.evolve(r, x=0.0, y=0.0).invert(z, noise),
    ),
    sensor(
        "invert_naive",
        "The mean is r (cos b, sin b), without the factor for the bearing's error.",
        POLAR,
        label="other_model",
        invert=_first_order,
    ),
    sensor(
        "invert_velocity_known", "A Doppler radar's new track knows its velocity exactly.", DOPPLER, invert=_known_crossing
    ),
    sensor("pose_ignored", "at returns the sensor where it was.", POLAR, at=lambda r, pose: r),
    sensor(
        "pose_heading_added", "The heading is added to the bearing, not subtracted.", POLAR, at=_moved(heading=np.negative)
    ),
    sensor(
        "pose_velocity_ignored",
        "The range rate is the target's alone, whatever the platform does.",
        DOPPLER,
        at=_moved(velocity=lambda v: None),
    ),
    sensor(
        "pose_of_the_first_run",
        "In a batch of platforms all stand where the first one does.",
        POLAR,
        at=_moved(position=lambda p: np.broadcast_to(p.reshape(-1, p.shape[-1])[0], p.shape)),
    ),
)
