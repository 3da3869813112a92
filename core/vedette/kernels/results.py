"""What kernels return that is more than one array: tuples with names; shapes are told by the kernels."""

from __future__ import annotations

from typing import NamedTuple

from vedette.space import Array, Indices, Mask
from vedette.types import Gaussian


class Updated(NamedTuple):
    """The moments after a return, and the log-likelihood of the returns."""

    mean: Array
    cov: Array
    loglik: Array


class Passed(NamedTuple):
    """The moments after a scan, the weights of its returns and their squared distances."""

    after: Gaussian
    weights: Array
    distance: Array


class Evaluated(NamedTuple):
    """Returns against tracks: log density, squared distance, log sqrt|S|, shift of the mean and posterior covariance."""

    loglik: Array
    distance: Array
    log_volume: Array
    shift: Array
    post: Array


class Step(NamedTuple):
    """The shift of a mean, and the covariance there."""

    shift: Array
    cov: Array


class Points(NamedTuple):
    """Sigma points as offsets from their mean, and their weights."""

    offsets: Array
    weights: Array


class Measured(NamedTuple):
    """What a sensor says of states: the measurement, its derivative and noise, the detection probability."""

    z: Array
    slope: Array
    noise: Array
    detects: Array


class Moved(NamedTuple):
    """What a motion says of states: where they move, the derivative of that, the noise."""

    mean: Array
    slope: Array
    noise: Array


class Weighted(NamedTuple):
    """Of weighted points: log likelihoods, their means; mean and covariance of the measurements expected, mean noise."""

    likelihoods: Array
    loglik: Array
    mean: Array
    cov: Array
    noise: Array


class ByRoot(NamedTuple):
    """S^-1, log |S|, the gain transposed and the posterior covariance of an update by square roots."""

    inverse: Array
    log_det: Array
    gain: Array
    post: Array


class Mixed(NamedTuple):
    """The modes' predicted log probabilities, and what each starts from."""

    log_prob: Array
    beliefs: tuple[Gaussian, ...]


class MixedMoments(NamedTuple):
    """The same over axes that all modes have, as two arrays."""

    log_prob: Array
    means: Array
    covs: Array


class Stacked(NamedTuple):
    """Modes over the same axes: an origin, the means from there, covariances."""

    origin: Array
    apart: Array
    covs: Array


class Combined(NamedTuple):
    """The modes' log probabilities after a scan, the mixture's moments, the log-likelihood of the scan."""

    log_prob: Array
    mean: Array
    cov: Array
    loglik: Array


class Weighed(NamedTuple):
    """An innovation of all modes, and the log posterior of the modes under each hypothesis."""

    loglik: Array
    distance: Array
    log_volume: Array
    nis: Array
    log_share: Array


class Split(NamedTuple):
    """The modes' log probabilities after association, and each one's weights."""

    log_prob: Array
    weights: tuple[Array, ...]


class Seen(NamedTuple):
    """Of each track: the probability of having been detected, its existence, and P_D."""

    hit: Array
    existence: Array
    p_detect: Array


class Assignments(NamedTuple):
    """Assignments, best first: the column of each row, and their costs."""

    columns: Indices
    costs: Array


class JointBest(NamedTuple):
    """Joint associations, best first: the hypothesis of each, what its tracks take, its score."""

    origin: Indices
    choice: Indices
    total: Array


class JointWeights(NamedTuple):
    """Weights of all joint associations, and the tracks of clusters that were too wide to be summed."""

    weights: Array
    wide: Mask


class BoxPairs(NamedTuple):
    """Pairs of a box and a point in it."""

    boxes: Indices
    points: Indices


class Shed(NamedTuple):
    """Hypotheses of clusters, flat: cluster, weights, starts and leaves; `rows`: what each of their leaves was before."""

    cluster: Indices
    weights: Array
    starts: Indices
    leaves: Indices
    rows: Indices


class Grown(NamedTuple):
    """The same after a scan: `code` says what became of each leaf, `lost` (c,) what each cluster lacks."""

    cluster: Indices
    weights: Array
    starts: Indices
    leaves: Indices
    code: Indices
    lost: Array
