"""Wrong cameras."""

from functools import partial

import attrs
import numpy as np

import vedette_flir as flir
from mutants.foreign.base import Mutant, mutant

SPOT = partial(flir.GaussianSpot, gain_amplitude=0.2, gain_spread=0.1, gain_background=0.1)


def _information(change):
    """Return an `information` that changes J, g and llr: a function of them and of the frame."""
    return lambda right, x, frame, at: change(*right.information(x, frame, at), frame)


def _frame(**change):
    """Return an `information` that takes the frame for another."""

    def information(right, x, frame, at):
        return right.information(x, attrs.evolve(frame, **{n: f(getattr(frame, n)) for n, f in change.items()}), at)

    return information


def _learns_position(right, x, frame):
    learnt = np.array(right.learn(x, frame))
    learnt[..., 0] += 0.1
    return learnt


def _learns_in_place(right, x, frame):
    x[...] = right.learn(x, frame)
    return x


imaging = partial(mutant, "imaging")

MUTANTS: tuple[Mutant, ...] = (
    imaging(
        "spot_score_sign",
        "The score points away from the target.",
        SPOT,
        information=_information(lambda J, g, llr, f: (J, -g, llr)),
    ),
    imaging(
        "spot_score_rows_first",
        "The score is ordered row, column.",
        SPOT,
        information=_information(lambda J, g, llr, f: (J, g[..., ::-1], llr)),
    ),
    imaging(
        "spot_transposed",
        "The picture is read column first.",
        SPOT,
        information=_frame(pixels=lambda p: np.swapaxes(p, -1, -2)),
    ),
    imaging(
        "spot_corner_forgotten", "The corner of a window is taken as 0.", SPOT, information=_frame(corner=lambda c: None)
    ),
    imaging(
        "spot_dead_pixels_black", "Dead pixels, NaN, are taken as 0 counts.", SPOT, information=_frame(pixels=np.nan_to_num)
    ),
    imaging(
        "spot_information_indefinite",
        "The outer product of the score is taken off the information.",
        SPOT,
        information=_information(lambda J, g, llr, f: (J - g[..., :, None] * g[..., None, :], g, llr)),
    ),
    imaging(
        "spot_information_floor",
        "The information is never 0, so that it can be inverted.",
        SPOT,
        information=_information(lambda J, g, llr, f: (J + 1e-3 * np.eye(2), g, llr)),
    ),
    imaging(
        "spot_at_expected",
        "The image is linearised at the expected place, whatever is asked for.",
        SPOT,
        information=lambda r, x, frame, at: r.information(x, frame, x),
    ),
    imaging(
        "spot_absolute",
        "The log-likelihood is not relative to the background.",
        SPOT,
        information=_information(lambda J, g, llr, f: (J, g, llr - np.nansum(f.pixels**2, axis=(-1, -2))[..., None] / 2)),
    ),
    imaging(
        "spot_noise_is_information",
        "noise gives the information, not its inverse.",
        SPOT,
        noise=lambda r, x: np.linalg.inv(r.noise(x)),
    ),
    imaging("spot_learns_position", "learn moves the target, too.", SPOT, learn=_learns_position),
    imaging("spot_learns_in_place", "learn changes the state that is passed in.", SPOT, learn=_learns_in_place),
)
