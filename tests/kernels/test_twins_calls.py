"""Which calls the compiled kernels take, which they leave to the reference, and what strange arguments do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.twins import REFERENCE, compare, seeds, without_reference
from vedette import Gaussian, kernels
from vedette.kernels import _compiled
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.range_bearing import RangeBearing

batches = st.sampled_from([(), (1,), (3,), (8,), (19,), (0,), (2, 1), (3, 4), (2, 9), (19, 2), (70,), (2, 3, 2)])


@given(seeds, batches, st.sampled_from([1.0, np.nan, np.inf, 1e13, -1e13]), st.booleans(), st.integers(1, 3))
def test_plain_is_what_the_reference_calls_so(seed, batch, odd, all_valid, axes):
    rng = np.random.default_rng(seed)
    z, valid = rng.normal(size=(*batch, 3, axes)), np.ones((*batch, 3), bool)
    if z.size:
        z.flat[rng.integers(z.size)] = odd
        valid.flat[rng.integers(valid.size)] = all_valid
    for scan in ((z, valid, axes), (z, valid, axes + 1), (z[..., 0], valid, axes)):
        assert kernels.is_plain(*scan, 1e12) == REFERENCE["is_plain"](*scan, 1e12)


@pytest.mark.parametrize("dtype", [np.float32, np.int64, ">f8"])
def test_other_numbers_than_double_are_converted(dtype):
    x, P, F = np.array([1, 2], dtype), np.eye(2).astype(dtype), np.array([[1, 1], [0, 1]], dtype)
    ahead = kernels.predict(x, P, F, P)
    assert ahead.mean.dtype == ahead.cov.dtype == np.float64
    np.testing.assert_array_equal(ahead.mean, [3, 2])
    np.testing.assert_array_equal(ahead.cov, [[3, 1], [1, 2]])


def test_common_sizes_are_taken_and_others_left_to_the_reference():
    for n, taken in ((1, True), (4, True), (12, True), (13, False)):
        x, P = np.zeros(n), np.eye(n)
        with without_reference("predict"):
            if taken:
                kernels.predict(x, P, P, P)
            else:
                with pytest.raises(AssertionError, match="left the call"):
                    kernels.predict(x, P, P, P)


def an_example_of_each():
    """Name to a call of usual sizes: n = 4, m = 2, r = 2, k = 3, two tracks."""
    x, P, F, H, R = np.ones((2, 4)), np.eye(4) + np.zeros((2, 1, 1)), np.eye(4), np.eye(2, 4), np.eye(2)
    xs, Ps, log_prob, k = np.ones((2, 2, 4)), np.eye(4) + np.zeros((2, 2, 1, 1)), np.log(np.full((2, 2), 0.5)), 3
    columns, distance, valid, exists = -np.ones((2, 1 + k)), np.ones((2, k)), np.ones(k, bool), np.full(2, 0.5)
    bank = ([x, x], [P, P], ((0, 1, 2, 3), (0, 1, 2, 3)), np.zeros((2, 4)), ())
    weights, said = np.full((2, 1 + k), 0.25), (columns, distance, np.ones(2), distance)
    points = (
        np.ones((2, 9, 4)),
        np.ones((2, 9, 2)),
        np.full(9, 1 / 9),
        np.ones((2, k, 2)),
        np.eye(2) + np.zeros((2, 1, 1, 1)),
    )
    one, sure = np.zeros(1, np.int64), np.ones(1)
    clutter = np.ones((2, k, 2)), H, R, 0.9, 0.99, 9.0, -2.0
    radar, turn = RangeBearing(5.0, 0.01).twin, CoordinatedTurn(0.5, 0.01).twin
    look, move = (radar.function, radar.parameters), (turn.function, turn.parameters)
    way, spread, around = np.ones((2, 5)), np.eye(5) + np.zeros((2, 1, 1)), np.zeros((2, 9, 4))
    return {
        "measure_twin": (x[:, :2], *look, 2),
        "move_twin": (way, 1.0, *move, ()),
        "predict_twin": (way, spread, 1.0, *move, ()),
        "predict_points_twin": (way, np.zeros((2, 11, 5)), np.full(11, 1 / 11), 1.0, *move, ()),
        "evaluate_twin": (x, P, np.ones((k, 2)), None, *look, (0, 1), 0.99, ((1, 6.0),)),
        "evaluate_points_twin": (x, around, points[2], np.ones((k, 2)), None, *look, (0, 1), 0.99, (), ((1, 6.0),)),
        "iterate_twin": (x, P, np.ones((k, 2)), None, *look, (0, 1), 0.99, (), ((1, 6.0),), 5),
        "predict_root_twin": (way, np.zeros((2, 5, 5)), 1.0, *move, ()),
        "evaluate_root_twin": (x, P, np.ones((k, 2)), None, *look, (0, 1), 0.99, ((1, 6.0),)),
        "scan_step_twin": (
            *(x[:, None], P[:, None], F, F, np.ones((2, k, 2)), *look, (0, 1)),
            *(0.99, 9.0, -2.0, False, ((1, 6.0),)),
        ),
        "evaluate_particles": (
            *(np.zeros((2, 9)), np.ones((k, 2)), np.ones((2, 9, 2)), R[None]),
            *(np.ones(1), 0.99, ((1, 6.0),)),
        ),
        "reweigh_particles": (np.zeros((2, 9)), np.zeros((2, 1 + k, 9)), columns, weights),
        "root": (P,),
        "lower_triangular": (P,),
        "cancels": (P, F, P),
        "claimed": (weights, True),
        "if_existing": (columns, columns[:, 0], exists),
        "given_existence": (weights, columns, columns, exists),
        "predict": (x, P, F, F),
        "propagate": (P, F, F),
        "over_axes": (((1.0, 2.0), (0.0, 1.0)), 2),
        "smooth_linear": (x, P, F, P, x, P, ()),
        "update": (x, P, x[:, :2], H, R),
        "filter_step": (x, P, F, F, x[:, :2], H, R),
        "scan_step": (x[:, None], P[:, None], F, F, np.ones((2, k, 2)), H, R, 0.9, 0.99, 9.0, -2.0, False, ()),
        "evaluate_returns": (P, np.ones((k, 2)), x[:, :2], H, R[None], 0.9, 0.99, ((1, 6.0),)),
        "weighted_update": (x, P, np.ones((2, k, 4)), P[:, None], weights, ((1, 6.0),)),
        "whiten": (x, P),
        "sigma_points": (P, 1.0),
        "evaluate_points": points,
        "pda_update": (xs, Ps, *clutter),
        "imm_mix": (log_prob, log_prob, xs, Ps),
        "imm_combine": (log_prob, log_prob, xs, Ps),
        "mix_modes": (log_prob, log_prob, *bank),
        "mixture_moments": (log_prob, *bank),
        "weigh_modes": (log_prob, [said, said]),
        "split_weights": (weights, np.full((2, 1 + k, 2), 0.5)),
        "gate_scores": (columns, distance, valid, exists, 2.0, np.array(-2.0), None, np.ones((3, 1), bool)),
        "sample_density": (distance, valid, 2.0, np.ones(2), 0.3),
        "softmax": (columns,),
        "one_hot": (columns,),
        "existence": (columns, weights, exists, columns, 0.99, True),
        "is_plain": (distance[..., None], valid | np.zeros((2, 1), bool), 1, 1e12),
        "best_joint": (np.zeros((3, 4)), np.array([[0, 1], [2, -1]]), np.array([3, 1])),
        "grow": (one, sure, np.array([0, 1]), one, np.zeros(1), one + 1, one, np.ones(1), valid, 5, 0.1),
        "shed": (one, sure, np.array([0, 1]), one, one, np.ones(1, bool), 0.1),
        "target_existence": (sure, np.array([0, 1]), one, one, sure, one),
        "joint_weights": (columns, 3),
        "wide_clusters": (columns, 3),
        "pairs_in_boxes": (x, x + 1, x, ((1, 6.0),), 100),
        "linked_clusters": (np.array([0, 1]), np.array([0, 0]), 2, 3),
        "k_best": (np.ones((2, 3)), 4),
        "normals": ([np.random.default_rng(1)], (3,)),
        "uniforms": ([np.random.default_rng(1)], (3,)),
    }


@pytest.mark.parametrize("name", sorted(REFERENCE))
def test_a_call_of_usual_sizes_is_not_left_to_the_reference(name):
    with without_reference(name):
        getattr(kernels, name)(*an_example_of_each()[name])


@pytest.mark.parametrize("name", sorted(REFERENCE))
def test_a_wrong_number_of_arguments_gets_the_references_error(name):
    with pytest.raises(TypeError, match="argument"):
        getattr(kernels, name)(*an_example_of_each()[name], None, None)


def test_a_scan_whose_returns_all_count_still_has_its_batch():
    valid = np.ones((4, 2), bool)
    given = np.ones((1, 1, 2)), valid, 2.0, np.zeros((1, 1)), 0.3
    assert kernels.sample_density(*given).shape == REFERENCE["sample_density"](*given).shape == (4, 1, 1)
    with pytest.raises(ValueError, match="broadcast"):
        kernels.gate_scores(
            -np.ones((3, 1, 3)), np.ones((3, 1, 2)), valid, np.ones((3, 1)), 2.0, np.array(-2.0), None, np.ones((3, 1), bool)
        )


class Meddler:
    """Becomes an array, and does something else on the way."""

    def __init__(self, array, act):
        self.array, self.act = array, act

    def __array__(self, dtype=None, copy=None):
        self.act()
        return self.array


def test_a_list_that_changes_while_it_is_read_does_no_harm():
    log_prob, bank = np.log([0.5, 0.5]), (((0, 1),) * 2, np.zeros((2, 2)), ())
    xs, Ps = [np.zeros(2), np.ones(2)], [np.eye(2), 2 * np.eye(2)]
    expected = kernels.mixture_moments(log_prob, list(xs), list(Ps), *bank)
    gone = [Meddler(xs[0], lambda: gone.clear()), xs[1] + 0]
    compare(kernels.mixture_moments(log_prob, gone, list(Ps), *bank), expected, "mixture_moments")
    assert gone == []


def test_an_interruption_is_not_taken_for_a_strange_argument():
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kernels.predict(Meddler(np.zeros(2), interrupt), np.eye(2), np.eye(2), np.eye(2))


def test_no_number_stays_none():
    nan = np.full((9, 1), np.nan)
    P, z = np.ones((9, 1, 1)), np.zeros((9, 1, 1))
    scan = P[:, None], z, nan[:, None], np.eye(1), P[:1], nan, 0.99, ((0, 6.0),)
    assert np.isnan(kernels.evaluate_returns(*scan).loglik).all()


def test_an_axis_that_is_not_there_cannot_wrap():
    P, periods = np.eye(2)[None], ((2, 6.28),)
    with pytest.raises(IndexError):
        kernels.evaluate_returns(P, np.zeros((1, 2)), np.zeros((1, 2)), np.eye(2), P[None], 0.9, 0.99, periods)
    with pytest.raises(IndexError):
        kernels.weighted_update(np.zeros((1, 2)), P, np.zeros((1, 1, 2)), P[None], np.ones((1, 2)), periods)
    with pytest.raises(IndexError):
        kernels.mixture_moments(np.zeros(1), (np.zeros(2),), (np.eye(2),), ((0, 1),), np.zeros((2, 2)), periods)


def test_wrong_shapes_get_the_references_error():
    with pytest.raises(ValueError, match=r"matmul|broadcast|mismatch"):
        kernels.predict(np.zeros(2), np.eye(2), np.eye(3), np.eye(2))
    with pytest.raises(TypeError):
        kernels.predict(np.zeros(2))


def test_a_result_is_made_of_types_with_fields_only():
    for other in (int, 3, object):
        with pytest.raises((TypeError, AttributeError)):
            _compiled.bind("predict", REFERENCE["predict"], other)
    assert type(kernels.predict(np.zeros(2), np.eye(2), np.eye(2), np.eye(2))) is Gaussian
