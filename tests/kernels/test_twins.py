"""The compiled kernels equal the reference: any sizes, batches, strides and broadcasts, on every instruction set."""

from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import association, modes, reference, streams

if kernels.weighted_update is reference.weighted_update:
    pytest.skip(f"kernels: {kernels.RUNNING}", allow_module_level=True)

from vedette.kernels import _compiled

REFERENCE = {
    name: getattr(home, name)
    for home in (reference, modes, association, streams)
    for name in kernels.__all__
    if hasattr(_compiled, name) and hasattr(home, name)
}


@contextmanager
def on(instruction_set):
    usual = _compiled.instruction_set()
    _compiled.use(instruction_set)
    try:
        yield
    finally:
        _compiled.use(usual)


@contextmanager
def without_reference(name):
    """The kernel takes the call itself, or fails."""

    def refused(*given):
        raise AssertionError(f"{name} left the call to the reference")

    _compiled.bind(name, refused)
    try:
        yield
    finally:
        _compiled.bind(name, REFERENCE[name])


class Draw:
    """Arrays of drawn batches, some broadcast, some with strides of their own, some not of float64."""

    def __init__(self, seed, batch, kind):
        self.rng, self.batch, self.kind = np.random.default_rng(seed), batch, kind

    def laid(self, a, core):
        """The same numbers, else laid out."""
        if self.kind == "shared" and a.size and self.rng.random() < 0.5:
            cut = self.rng.integers(len(self.batch) + 1)
            return a[(0,) * cut] if cut else a
        if self.kind == "strided":
            wide = np.zeros((*a.shape[:-1], 2 * a.shape[-1])) if a.ndim else a
            if a.ndim:
                wide[..., ::2] = a
                return wide[..., ::2]
        if self.kind == "reversed" and len(self.batch):
            return np.ascontiguousarray(a[::-1])[::-1]
        if self.kind == "broadcast" and len(self.batch):
            return np.broadcast_to(a[:1], a.shape) if a.shape[0] else a
        return a

    def vector(self, *shape, scale=1.0):
        return self.laid(scale * self.rng.normal(size=(*self.batch, *shape)), len(shape))

    def cov(self, n, *more, batch=None):
        a = self.rng.normal(size=(*(self.batch if batch is None else batch), *more, n, n))
        spread = a @ np.swapaxes(a, -1, -2) + 0.3 * np.eye(n)
        return self.laid(spread, 2 + len(more))

    def logs(self, *shape):
        return self.vector(*shape, scale=3.0)


seeds = st.integers(0, 2**32 - 1)
batches = st.sampled_from([(), (1,), (3,), (8,), (19,), (0,), (2, 1), (3, 4), (2, 9), (19, 2), (70,), (2, 3, 2)])
kinds = st.sampled_from(["plain", "shared", "strided", "reversed", "broadcast"])
states = st.integers(1, 14)
measured = st.integers(1, 5)
counts = st.integers(0, 6)
PERIODS = [(), ((0, 2 * np.pi),)]


def agree(name, *given):
    expected = REFERENCE[name](*given)
    for instruction_set in _compiled.instruction_sets():
        with on(instruction_set):
            found = getattr(kernels, name)(*given)
        compare(found, expected, instruction_set)


def compare(found, expected, what):
    if isinstance(expected, tuple):
        assert isinstance(found, tuple)
        assert len(found) == len(expected), what
        for one, other in zip(found, expected, strict=True):
            compare(one, other, what)
        return
    expected = np.broadcast_to(expected, np.shape(found))  # the reference may leave out axes along which nothing changes
    scale = max(1.0, np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected)))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-11 * scale, err_msg=what)


@given(seeds, batches, kinds, states)
def test_prediction(seed, batch, kind, n):
    draw = Draw(seed, batch, kind)
    x, P, F, Q = draw.vector(n), draw.cov(n), draw.vector(n, n), draw.cov(n)
    agree("predict", x, P, F, Q)
    agree("predict", x, P, np.eye(n), np.eye(n))
    agree("propagate", P, F, Q)


@given(seeds, batches, kinds, states, measured, st.floats(-7, 2))
def test_one_sure_return(seed, batch, kind, n, m, sharpness):
    """Of any sharpness, as the covariance is updated in another way where digits would cancel."""
    draw = Draw(seed, batch, kind)
    x, P, F, Q = draw.vector(n), draw.cov(n), draw.vector(n, n), draw.cov(n)
    z, H, R = draw.vector(m), draw.vector(m, n), draw.cov(m) * (10.0**sharpness if m <= min(n, 2) else 1.0)
    agree("update", x, P, z, H, R)
    agree("filter_step", x, P, F, Q, z, H[(0,) * (H.ndim - 2)] if H.size else np.ones((m, n)), R)


@given(seeds, batches, kinds, states, measured, counts, st.booleans(), st.sampled_from(PERIODS), st.integers(1, 3))
def test_returns_of_a_scan_and_their_mixture(seed, batch, kind, n, m, k, shared, periods, t):
    draw, runs = Draw(seed, (*batch, t), kind), Draw(seed + 1, batch, kind)
    P, z, expected, H = draw.cov(n), runs.vector(k, m, scale=4.0), draw.vector(m, scale=4.0), draw.vector(m, n)
    R = draw.cov(m, 1 if shared else max(k, 1))
    if not shared and k == 0:
        R = R[..., :0, :, :]
    p_detect = 1 / (1 + np.exp(draw.vector()))
    z, expected = np.broadcast_to(z, (*batch, k, m)), np.broadcast_to(expected, (*batch, t, m))
    P = np.broadcast_to(P, (*batch, t, n, n))
    given = P, z, expected, H, R, p_detect, 0.99, periods
    agree("evaluate_returns", *given)
    *_, shift, post = REFERENCE["evaluate_returns"](*given)
    weights = draw.rng.dirichlet(np.ones(1 + k), size=(*batch, t))
    agree("weighted_update", np.broadcast_to(draw.vector(n), (*batch, t, n)), P, shift, post, weights, periods)


@given(seeds, batches, kinds, st.integers(1, 7), st.integers(1, 6), st.sampled_from(PERIODS), st.booleans())
def test_modes_that_interact(seed, batch, kind, r, n, periods, possible):
    draw = Draw(seed, batch, kind)
    own = tuple(tuple(sorted(draw.rng.choice(n, draw.rng.integers(1, n + 1), replace=False).tolist())) for _ in range(r))
    xs = [np.broadcast_to(draw.vector(len(axes)), (*batch, len(axes))) for axes in own]
    Ps = [np.broadcast_to(draw.cov(len(axes)), (*batch, len(axes), len(axes))) for axes in own]
    absent = np.abs(draw.rng.normal(size=(2, n)))
    log_prob = np.log(draw.rng.dirichlet(np.ones(r), size=batch))
    transition = draw.rng.dirichlet(np.ones(r), size=r)
    if not possible:
        transition[:, -1] = 0.0
        log_prob[..., 0] = -800.0
    with np.errstate(divide="ignore"):
        log_transition = np.log(transition)
    agree("interact", log_prob, log_transition, xs, Ps, own, absent, periods)
    agree("together", log_prob, tuple(xs), Ps, own, absent, periods)


@given(seeds, batches, kinds, states, measured, counts, st.booleans(), st.sampled_from([0.0, 0.5, 3.0]))
def test_points(seed, batch, kind, n, m, k, shared, kappa):
    draw = Draw(seed, batch, kind)
    P = draw.cov(n)
    agree("sigma_points", P, kappa)
    dx, weights = REFERENCE["sigma_points"](np.broadcast_to(P, (*batch, n, n)), kappa)
    dz = np.tanh(dx @ draw.rng.normal(size=(n, m)))
    dz = dz - np.sum(dz * weights[:, None], axis=-2, keepdims=True)
    R = draw.cov(m, 1 if shared else max(k, 1))
    if not shared and k == 0:
        R = R[..., :0, :, :]
    nu, R = np.broadcast_to(draw.vector(k, m), (*batch, k, m)), np.broadcast_to(R, (*batch, *R.shape[-3:]))
    agree("evaluate_points", dx, dz, weights, nu, R)


def test_points_of_axes_without_variance():
    P = np.array([[4.0, 0.0, 2.0], [0.0, 0.0, 0.0], [2.0, 0.0, 1.0]])
    agree("sigma_points", np.stack([P, np.eye(3)] * 5), 1.0)


@given(seeds, batches, kinds, states, st.booleans())
def test_whitened_errors(seed, batch, kind, n, zero_variance):
    draw = Draw(seed, batch, kind)
    P = draw.cov(n)
    if zero_variance:
        P = P * np.outer(np.arange(n) > 0, np.arange(n) > 0)
    agree("whiten", draw.vector(n), P)


@pytest.mark.parametrize(
    "flaw", [[[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]]]
)
def test_whitening_refuses_what_is_no_covariance(flaw):
    with pytest.raises(ValueError, match="cov: "):
        kernels.whiten(np.zeros((20, 2)), np.stack([np.eye(2)] * 19 + [np.array(flaw)]))
    assert np.isnan(kernels.whiten(np.array([np.nan, 0.0]), np.eye(2))[0])


@given(seeds, batches, kinds, st.integers(1, 7), states, measured, counts, st.booleans(), st.sampled_from([1.0, 1e-5]))
def test_the_stacked_imm_pdaf(seed, batch, kind, r, n, m, k, possible, sharpness):
    draw = Draw(seed, batch, kind)
    xs, Ps, H, R = draw.vector(r, n), draw.cov(n, r), draw.vector(m, n), draw.cov(m) * (sharpness if m <= min(n, 2) else 1.0)
    xs, Ps = np.broadcast_to(xs, (*batch, r, n)), np.broadcast_to(Ps, (*batch, r, n, n))
    log_prob = np.log(draw.rng.dirichlet(np.ones(r), size=batch))
    transition = draw.rng.dirichlet(np.ones(r), size=r)
    if not possible:
        transition[:, -1] = 0.0
        log_prob[..., 0] = -800.0
        log_prob -= reference.log_sum(log_prob)[..., None]
    with np.errstate(divide="ignore"):
        log_transition = np.log(transition)
    agree("imm_mix", log_prob, log_transition, xs, Ps)
    agree("imm_combine", log_prob, np.broadcast_to(draw.logs(r), (*batch, r)), xs, Ps)
    z = np.broadcast_to(draw.vector(k, m, scale=3.0), (*batch, k, m))
    for p_detect, limit in ((0.9, 9.0), (1.0, np.inf)):
        agree("pda_update", xs, Ps, z, H, R, p_detect, 0.99, limit, -2.0)


@given(seeds, batches, kinds, st.integers(1, 7), counts)
def test_modes_weighed_and_weights_split(seed, batch, kind, r, k):
    draw = Draw(seed, batch, kind)
    log_prob = np.broadcast_to(draw.logs(r), (*batch, r))
    logliks = [np.broadcast_to(draw.logs(1 + k), (*batch, 1 + k)) for _ in range(r)]
    distances, nis = ([np.broadcast_to(np.exp(draw.logs(k)), (*batch, k)) for _ in range(r)] for _ in range(2))
    volumes = [np.broadcast_to(draw.logs(), batch) for _ in range(r)]
    agree("weigh_modes", log_prob, list(zip(logliks, distances, volumes, nis, strict=True)))
    weights = draw.rng.dirichlet(np.ones(1 + k), size=batch)
    if k:
        weights[..., 0] *= draw.rng.random(batch) < 0.5
    agree("split_weights", weights, np.broadcast_to(draw.logs(1 + k, r), (*batch, 1 + k, r)))


@given(seeds, batches, kinds, st.integers(1, 4), counts, st.booleans(), st.booleans(), st.booleans())
def test_scores_weights_and_existence(seed, batch, kind, t, k, all_valid, evidence, exclusive):
    draw, runs = Draw(seed, (*batch, t), kind), Draw(seed + 1, batch, kind)
    loglik = np.broadcast_to(-np.exp(draw.vector(1 + k)), (*batch, t, 1 + k))
    distance = np.broadcast_to(np.exp(draw.vector(k)), (*batch, t, k))
    valid = np.ones((*batch, k), bool) | all_valid if all_valid else runs.rng.random((*batch, k)) < 0.7
    existence = np.broadcast_to(1 / (1 + np.exp(draw.vector())), (*batch, t))
    likelier = np.broadcast_to(runs.vector(1, k), (*batch, 1, k)) if evidence else None
    volume = np.broadcast_to(draw.vector(), (*batch, t))
    for density in (np.float64(-2.0), np.array(-2.0), runs.vector(1, 1), np.broadcast_to(runs.vector(1, k), (*batch, 1, k))):
        agree("gate_scores", loglik, distance, valid, existence, 2.0, density, likelier)
    agree("sample_density", distance, valid, 2.0, volume, 0.3)
    scores = REFERENCE["gate_scores"](loglik, distance, valid, existence, 2.0, np.array(-1.0), likelier)
    for name in ("softmax", "one_hot"):
        agree(name, scores)
        weights = REFERENCE[name](scores)
        agree("existence", scores, weights, existence, loglik, 0.99, exclusive)


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
    mean, cov = kernels.predict(x, P, F, P)
    assert mean.dtype == cov.dtype == np.float64
    np.testing.assert_array_equal(mean, [3, 2])
    np.testing.assert_array_equal(cov, [[3, 1], [1, 2]])


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
    clutter = np.ones((2, k, 2)), H, R, 0.9, 0.99, 9.0, -2.0
    return {
        "predict": (x, P, F, F),
        "propagate": (P, F, F),
        "update": (x, P, x[:, :2], H, R),
        "filter_step": (x, P, F, F, x[:, :2], H, R),
        "evaluate_returns": (P, np.ones((k, 2)), x[:, :2], H, R[None], 0.9, 0.99, ((1, 6.0),)),
        "weighted_update": (x, P, np.ones((2, k, 4)), P[:, None], weights, ((1, 6.0),)),
        "whiten": (x, P),
        "sigma_points": (P, 1.0),
        "evaluate_points": points,
        "pda_update": (xs, Ps, *clutter),
        "imm_mix": (log_prob, log_prob, xs, Ps),
        "imm_combine": (log_prob, log_prob, xs, Ps),
        "interact": (log_prob, log_prob, *bank),
        "together": (log_prob, *bank),
        "weigh_modes": (log_prob, [said, said]),
        "split_weights": (weights, np.full((2, 1 + k, 2), 0.5)),
        "gate_scores": (columns, distance, valid, exists, 2.0, np.array(-2.0), None),
        "sample_density": (distance, valid, 2.0, np.ones(2), 0.3),
        "softmax": (columns,),
        "one_hot": (columns,),
        "existence": (columns, weights, exists, columns, 0.99, True),
        "is_plain": (distance[..., None], valid | np.zeros((2, 1), bool), 1, 1e12),
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
        kernels.gate_scores(-np.ones((3, 1, 3)), np.ones((3, 1, 2)), valid, np.ones((3, 1)), 2.0, np.array(-2.0), None)


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
    expected = kernels.together(log_prob, list(xs), list(Ps), *bank)
    gone = [Meddler(xs[0], lambda: gone.clear()), xs[1] + 0]
    compare(kernels.together(log_prob, gone, list(Ps), *bank), expected, "together")
    assert gone == []


def test_an_interruption_is_not_taken_for_a_strange_argument():
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kernels.predict(Meddler(np.zeros(2), interrupt), np.eye(2), np.eye(2), np.eye(2))


def test_no_number_stays_none():
    nan = np.full((9, 1), np.nan)
    P, z = np.ones((9, 1, 1)), np.zeros((9, 1, 1))
    assert np.isnan(kernels.evaluate_returns(P[:, None], z, nan[:, None], np.eye(1), P[:1], nan, 0.99, ((0, 6.0),))[0]).all()


@pytest.mark.parametrize("shape", [(), (0,), (5,), (3, 2)])
@pytest.mark.parametrize("name", ["normals", "uniforms"])
def test_numbers_are_what_each_generator_draws_by_itself(name, shape):
    def generators():
        return [np.random.default_rng(7), np.random.Generator(np.random.MT19937(8)), np.random.default_rng(9)]

    ours, theirs = generators(), generators()
    for _ in range(2):
        np.testing.assert_array_equal(getattr(kernels, name)(ours, shape), REFERENCE[name](theirs, shape))
    assert [a.bit_generator.random_raw() for a in ours] == [b.bit_generator.random_raw() for b in theirs]
    same = np.random.default_rng(1)
    np.testing.assert_array_equal(
        getattr(kernels, name)([same, same], (4,)).ravel(), REFERENCE[name]([np.random.default_rng(1)], (8,)).ravel()
    )


def test_a_generator_of_another_kind_draws_in_its_own_way():
    class Halves(np.random.Generator):
        def random(self, size=None):
            return np.full(size, 0.5)

    assert np.all(kernels.uniforms([Halves(np.random.PCG64(1))], (4,)) == 0.5)


def test_a_mode_that_a_return_is_next_to_impossible_for():
    xs, Ps = np.array([[0.0], [53.54]]), np.ones((2, 1, 1))
    agree("pda_update", xs, Ps, np.zeros((1, 1)), np.eye(1), np.eye(1), 0.9, 0.99, 9.0, -2.0)


def test_an_axis_that_is_not_there_cannot_wrap():
    P, periods = np.eye(2)[None], ((2, 6.28),)
    with pytest.raises(IndexError):
        kernels.evaluate_returns(P, np.zeros((1, 2)), np.zeros((1, 2)), np.eye(2), P[None], 0.9, 0.99, periods)
    with pytest.raises(IndexError):
        kernels.weighted_update(np.zeros((1, 2)), P, np.zeros((1, 1, 2)), P[None], np.ones((1, 2)), periods)
    with pytest.raises(IndexError):
        kernels.together(np.zeros(1), (np.zeros(2),), (np.eye(2),), ((0, 1),), np.zeros((2, 2)), periods)


def test_wrong_shapes_get_the_references_error():
    with pytest.raises(ValueError, match=r"matmul|broadcast|mismatch"):
        kernels.predict(np.zeros(2), np.eye(2), np.eye(3), np.eye(2))
    with pytest.raises(TypeError):
        kernels.predict(np.zeros(2))


@given(seeds, st.integers(2, 12), st.integers(1, 4), st.floats(-14, 14))
def test_covariances_stay_what_they_are_on_ill_conditioned_input(seed, n, m, exponent):
    """Symmetric to the last bit, and no eigenvalue below rounding, whatever the scales: both twins promise it."""
    rng = np.random.default_rng(seed)
    scales = 10.0 ** rng.uniform(-6, 6, n)
    a = rng.normal(size=(9, n, n)) * scales[:, None]
    P, H = a @ np.swapaxes(a, -1, -2), rng.normal(size=(m, n)) / scales
    R = np.eye(m) * 10.0**exponent
    for update in (kernels.update, reference.update):
        cov = update(np.zeros(n), P, np.zeros(m), H, R)[1]
        np.testing.assert_array_equal(cov, np.swapaxes(cov, -1, -2))
        scaled = cov / np.sqrt(np.einsum("...i,...j->...ij", *2 * [np.diagonal(cov, axis1=-2, axis2=-1)]))
        assert np.linalg.eigvalsh(scaled).min() > -1e-7


@pytest.mark.parametrize("mutant", ["predict", "weighted_update", "interact", "existence"])
def test_the_comparison_bites(monkeypatch, mutant):
    """A reference that is wrong by 1e-8 is told from the kernels."""
    right = REFERENCE[mutant]

    def wrong(*given):
        first, *rest = right(*given)
        return first * (1 + 1e-8) + 1e-8, *rest

    monkeypatch.setitem(REFERENCE, mutant, wrong)
    checks = {
        "predict": test_prediction,
        "weighted_update": test_returns_of_a_scan_and_their_mixture,
        "interact": test_modes_that_interact,
        "existence": test_scores_weights_and_existence,
    }
    with pytest.raises(AssertionError):
        checks[mutant]()


def test_exponentials_and_logarithms_of_eight_lanes_are_the_librarys():
    """Those of the vectors are written out; seen through a mixture's weights and a detection probability."""
    rng = np.random.default_rng(0)
    logs = np.concatenate([rng.uniform(-745, 0, 40_000), rng.uniform(-1, 0, 39_998), [-np.inf, -746.0]])
    log_prob = np.stack([np.zeros_like(logs), logs], axis=-1)
    ends = [np.zeros((len(logs), 1)), np.ones((len(logs), 1))]
    cov = [np.ones((len(logs), 1, 1))] * 2
    p_detect = np.concatenate([10 ** rng.uniform(-305, 0, 40_000), rng.random(39_999), [0.0]])[:, None]
    n = len(p_detect)
    looks = np.ones((n, 1, 1, 1)), np.zeros((n, 1, 1)), np.zeros((n, 1, 1)), np.ones((1, 1)), np.ones((1, 1, 1))
    for instruction_set in _compiled.instruction_sets():
        with on(instruction_set):
            mean = kernels.together(log_prob, ends, cov, ((0,), (0,)), np.zeros((2, 1)), ())[0][:, 0]
            loglik = kernels.evaluate_returns(*looks, p_detect, 0.0, ())[0][:, 0, 1]
        np.testing.assert_allclose(mean, np.exp(logs), rtol=1e-15, atol=5e-324)
        certain = kernels.evaluate_returns(*(a[:1] if a.shape[0] == n else a for a in looks), 1.0, 0.0, ())[0][0, 0, 1]
        np.testing.assert_allclose(loglik - certain, reference.safe_log(p_detect[:, 0]), rtol=1e-15, atol=3e-16)
