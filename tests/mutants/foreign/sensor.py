"""Wrong sensors: what is measured, and how well."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import INHERITED, Mutant, mutant

POLAR = partial(
    standard.RangeBearing,
    sigma_range=8.0,
    sigma_bearing=0.02,
    detection_probability=0.9,
    max_range=4000.0,
    clutter_per_scan=5.0,
    x=50.0,
    y=-30.0,
    heading=0.3,
)
DOPPLER = partial(
    standard.RangeBearingRate,
    sigma_range=8.0,
    sigma_bearing=0.02,
    sigma_rate=0.8,
    max_range=4000.0,
    max_rate=60.0,
    clutter_per_scan=5.0,
)
SPACE = partial(standard.RangeBearingElevation, sigma_range=8.0, sigma_bearing=0.02, sigma_elevation=0.03)
BEARING = partial(standard.BearingOnly, sigma_bearing=0.02)
RANGE = partial(standard.RangeOnly, sigma_range=8.0)
POSITION = partial(standard.CartesianPosition, sigma=5.0, detection_probability=0.9, clutter_density=1e-6)
RADAR_POSITION = partial(standard.PolarPosition, sigma_range=3.0, sigma_bearing=0.05, x=100.0, y=-200.0)
BIASED = partial(standard.Biased, of=POLAR(), add={"bearing": "azimuth_bias"}, spread={"azimuth_bias": 0.1})
LATE = partial(standard.Biased, of=POLAR(), lag="late")


def _alternate(n, i):
    """Return n ones, but -1 at i."""
    return np.where(np.arange(n) == i, -1.0, 1.0)


def _bearing_row(right, x, factor):
    slope = np.array(right.jacobian(x))
    slope[..., 1, :] *= factor(x)
    return slope


def _rate_by_velocity_alone(right, x):
    slope = np.array(right.jacobian(x))
    slope[..., 2, :2] = 0.0
    return slope


def _with(axis, change):
    """Return a measurement with one component changed by a function of it and of the state."""

    def measure(right, x):
        z = np.array(right.measure(x))
        z[..., axis] = change(z[..., axis], x)
        return z

    return measure


def _of_the_first(right, x):
    return right.jacobian(x.reshape(-1, x.shape[-1])[:1])[0] if x.size else right.jacobian(x)


def _learning():
    """Return a noise that grows by 1 % with each call."""
    calls = []

    def noise(right, x):
        calls.append(x)
        return right.noise(x) * 1.01 ** len(calls)

    return noise


def _other_rotation(right, x):
    mirrored = np.stack([x[..., 0], 2 * right.y - x[..., 1]], axis=-1)
    return right.noise(mirrored)


def _without_bias_column(right, x):
    slope = np.array(right.jacobian(x))
    slope[..., [name not in right.of.observes for name in right.observes.names]] = 0.0
    return slope


def _plain_unit_vector(right, x):
    with np.errstate(divide="ignore", invalid="ignore"):
        return (x / np.sqrt(np.sum(x**2, axis=-1, keepdims=True)))[..., None, :]


def _in_place(right, x):
    x -= [right.x, right.y]
    return attrs.evolve(right, x=0.0, y=0.0).measure(x)


sensor = partial(mutant, "sensor")

MUTANTS: tuple[Mutant, ...] = (
    sensor(
        "polar_from_north",
        "The bearing is atan2(dx, dy), a compass bearing, in measure alone.",
        POLAR,
        measure=_with(1, lambda b, x: np.pi / 2 - b),
        jacobian=INHERITED,
    ),
    sensor(
        "polar_bearing_unwrapped",
        "A heading makes bearings leave [-pi, pi).",
        POLAR,
        label="other_model",
        measure=_with(1, lambda b, x: b % (2 * np.pi)),
    ),
    sensor(
        "polar_r_in_degrees",
        "R holds the bearing's variance in deg^2.",
        POLAR,
        noise=lambda r, x: r.noise(x) * np.array([[1.0, 1.0], [1.0, np.degrees(1.0) ** 2]]),
    ),
    sensor("polar_r_not_squared", "R holds standard deviations.", POLAR, noise=lambda r, x: np.sqrt(r.noise(x))),
    sensor("polar_h_transposed", "H is transposed.", POLAR, jacobian=lambda r, x: np.swapaxes(r.jacobian(x), -1, -2)),
    sensor(
        "polar_h_once_over_r",
        "The bearing's derivative is divided by r, not r^2.",
        POLAR,
        jacobian=lambda r, x: _bearing_row(r, x, lambda x: r.measure(x)[..., :1]),
    ),
    sensor("polar_h_of_the_first", "All tracks have the first one's H.", POLAR, jacobian=_of_the_first),
    sensor("polar_in_place", "The station is subtracted from the state that is passed in.", POLAR, measure=_in_place),
    sensor("polar_learns", "R grows with each call, by state that nobody sees.", POLAR, noise=_learning()),
    sensor(
        "polar_noise_of_range",
        "The range's deviation is proportional to the range, and 0 at the radar.",
        RANGE,
        noise=lambda r, x: (0.01 * r.measure(x)[..., None]) ** 2,
    ),
    sensor("range_nan_at_station", "The unit vector to a target on the radar is 0 / 0.", RANGE, jacobian=_plain_unit_vector),
    sensor(
        "range_float32",
        "Ranges are computed in single precision.",
        RANGE,
        measure=lambda r, x: r.measure(x).astype(np.float32),
    ),
    sensor(
        "bearing_not_periodic",
        "The bearing is declared without a period.",
        BEARING,
        measurement=lambda r: vedette.Space.of(bearing="rad"),
    ),
    sensor(
        "bearing_degrees",
        "The bearing is in degrees, where rad is declared.",
        BEARING,
        measure=lambda r, x: np.degrees(r.measure(x)),
        jacobian=INHERITED,
    ),
    sensor(
        "doppler_sign",
        "The range rate is positive for a target that approaches, but not in invert.",
        DOPPLER,
        measure=lambda r, x: r.measure(x) * _alternate(3, 2),
        jacobian=INHERITED,
    ),
    sensor("doppler_h_velocity_only", "H ignores that the line of sight turns.", DOPPLER, jacobian=_rate_by_velocity_alone),
    sensor(
        "space_ground_range",
        "The range is that over ground; invert takes a slant range.",
        SPACE,
        measure=_with(0, lambda r, x: np.hypot(x[..., 0], x[..., 1])),
        jacobian=INHERITED,
    ),
    sensor(
        "position_swapped_axes",
        "It observes y, x and measures x, y: the values are not exchanged.",
        POSITION,
        observes=lambda r: vedette.Space.of(y="m", x="m"),
    ),
    sensor(
        "radar_position_other_rotation",
        "The error ellipse is turned by minus the bearing.",
        RADAR_POSITION,
        noise=_other_rotation,
    ),
    sensor(
        "biased_column_lost",
        "H lacks the column of the bias, which is then never learnt.",
        BIASED,
        jacobian=_without_bias_column,
    ),
    sensor(
        "late_is_early",
        "The lag has the wrong sign: returns come from the future.",
        LATE,
        label="other_model",
        measure=lambda r, x: r.measure(x * [-1.0 if name == r.lag else 1.0 for name in r.observes.names]),
        jacobian=INHERITED,
    ),
)
