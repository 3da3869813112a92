"""The compiled kernels equal the reference: any sizes, batches, strides and broadcasts, on every instruction set."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.twins import REFERENCE, agree, seeds
from vedette import kernels
from vedette.kernels import reference


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


batches = st.sampled_from([(), (1,), (3,), (8,), (19,), (0,), (2, 1), (3, 4), (2, 9), (19, 2), (70,), (2, 3, 2)])
kinds = st.sampled_from(["plain", "shared", "strided", "reversed", "broadcast"])
states = st.integers(1, 14)
measured = st.integers(1, 5)
counts = st.integers(0, 6)
PERIODS = [(), ((0, 2 * np.pi),)]


@given(seeds, batches, kinds, states)
def test_prediction(seed, batch, kind, n):
    draw = Draw(seed, batch, kind)
    x, P, F, Q = draw.vector(n), draw.cov(n), draw.vector(n, n), draw.cov(n)
    agree("predict", x, P, F, Q)
    agree("predict", x, P, np.eye(n), np.eye(n))
    agree("propagate", P, F, Q)


@given(seeds, st.integers(1, 5), st.integers(1, 5), st.booleans())
def test_a_block_over_axes(seed, p, count, as_rows):
    block = np.random.default_rng(seed).normal(size=(p, p))
    agree("over_axes", tuple(map(tuple, block.tolist())) if as_rows else block, count)
    np.testing.assert_array_equal(kernels.over_axes(block, count), np.kron(block, np.eye(count)))


@given(seeds, batches, kinds, states, st.sampled_from([(), ((0, 2 * np.pi),)]), st.sampled_from([1.0, 1e-4, 0.0]))
def test_smoothing(seed, batch, kind, n, periods, share):
    """Also where the last axis has no variance, or nothing disturbs the motion."""
    draw = Draw(seed, batch, kind)
    P, Q = draw.cov(n), share * draw.cov(n)
    if share == 0.0:
        P = P * (np.arange(n) < max(n - 1, 1)) * (np.arange(n) < max(n - 1, 1))[:, None]
    F = np.triu(draw.rng.normal(size=(n, n)), 1) / np.sqrt(max(n, 1)) + np.eye(n)  # else 12 axes leave 8 digits of 16
    agree("smooth_linear", draw.vector(n), P, F, Q, draw.vector(n), draw.cov(n), periods)


@given(seeds, batches, kinds, states, measured, st.floats(-7, 2))
@pytest.mark.costly
def test_one_sure_return(seed, batch, kind, n, m, sharpness):
    """Of any sharpness, as the covariance is updated in another way where digits would cancel."""
    draw = Draw(seed, batch, kind)
    x, P, F, Q = draw.vector(n), draw.cov(n), draw.vector(n, n), draw.cov(n)
    z, H, R = draw.vector(m), draw.vector(m, n), draw.cov(m) * (10.0**sharpness if m <= min(n, 2) else 1.0)
    agree("update", x, P, z, H, R)
    agree("filter_step", x, P, F, Q, z, H[(0,) * (H.ndim - 2)] if H.size else np.ones((m, n)), R)


@given(
    seeds,
    batches,
    kinds,
    states,
    measured,
    counts,
    st.booleans(),
    st.sampled_from(PERIODS),
    st.sampled_from([0.3, 0.9, 1.0]),
    st.sampled_from([0.99, 1.0]),
)
def test_a_scan_in_one(seed, batch, kind, n, m, k, best, periods, p_detect, p_gate):
    """More returns than it is compiled for, too, and returns beyond the gate."""
    draw, runs, model = Draw(seed, (*batch, 1), kind), Draw(seed + 1, batch, kind), Draw(seed + 2, (), "plain")
    F, Q, H, R = model.vector(n, n), model.cov(n), model.vector(m, n), model.cov(m)
    x, P = np.broadcast_to(draw.vector(n), (*batch, 1, n)), np.broadcast_to(draw.cov(n), (*batch, 1, n, n))
    z = np.broadcast_to(runs.vector(k, m, scale=4.0), (*batch, k, m))
    agree("scan_step", x, P, F, Q, z, H, R, p_detect, p_gate, float(3.0 * m), np.array(-4.0), best, periods)


@pytest.mark.parametrize("name", ["predict", "filter_step", "scan_step", "gate_scores"])
def test_a_batch_beyond_the_cache_is_what_its_parts_are(name):
    """Results that are written past the cache, in whole lines: of as many problems as fill them, and of a few more."""
    rng, count, k = np.random.default_rng(1), 60_005, 2
    spread = rng.normal(size=(count, 1, 4, 4))
    x, P = rng.normal(size=(count, 1, 4)), spread @ np.swapaxes(spread, -1, -2) + np.eye(4)
    F, Q, H, R, z = np.eye(4) + np.eye(4, k=2), np.eye(4), np.eye(2, 4), np.eye(2), 3.0 * rng.normal(size=(count, k, 2))
    columns = rng.normal(size=(count * 7, 1, 1 + k))
    given = {
        "predict": lambda s: (x[s], P[s], F, Q),
        "filter_step": lambda s: (x[s], P[s], F, Q, z[s, :1], H, R),
        "scan_step": lambda s: (x[s], P[s], F, Q, z[s], H, R, 0.9, 0.99, 9.0, -3.0, False, ()),
        "gate_scores": lambda s: (
            *(columns[s], columns[s, :, 1:], columns[s, 0, 1:] < 2, np.full((len(columns[s]), 1), 0.5)),
            *(1.0, -2.0, None, columns[s, :, 0] > 0),
        ),
    }[name]
    kernel = getattr(kernels, name)
    whole = leaves(kernel(*given(slice(None))))
    for part in (slice(0, 8), slice(30_000, 30_016), slice(count - 5, count)):
        for all_of_it, some in zip(whole, leaves(kernel(*given(part))), strict=True):
            np.testing.assert_array_equal(all_of_it[part], some)


def leaves(value):
    """All arrays of a kernel's result."""
    if isinstance(value, np.ndarray):
        return [value]
    parts = value if isinstance(value, tuple) else (value.mean, value.cov)
    return [leaf for part in parts for leaf in leaves(part)]


@given(seeds, batches, kinds, states, measured, counts, st.booleans(), st.sampled_from(PERIODS), st.integers(1, 3))
@pytest.mark.costly
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
    detail = REFERENCE["evaluate_returns"](*given).detail
    weights = draw.rng.dirichlet(np.ones(1 + k), size=(*batch, t))
    agree("weighted_update", np.broadcast_to(draw.vector(n), (*batch, t, n)), P, detail.shift, detail.post, weights, periods)


@given(seeds, batches, kinds, st.integers(1, 7), st.integers(1, 6), st.sampled_from(PERIODS), st.booleans())
@pytest.mark.costly
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
    agree("mix_modes", log_prob, log_transition, xs, Ps, own, absent, periods)
    agree("mixture_moments", log_prob, tuple(xs), Ps, own, absent, periods)


@given(seeds, batches, kinds, states, measured, counts, st.booleans(), st.sampled_from([0.0, 0.5, 3.0]))
@pytest.mark.costly
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
    agree("root", P)


@given(seeds, batches, kinds, st.integers(1, 40), counts, st.sampled_from(["all", "some", "none"]))
def test_points_that_association_reweighs(seed, batch, kind, p, k, possible):
    """Also where a hypothesis, or all of them, are impossible at points, and where one has no weight."""
    draw = Draw(seed, batch, kind)
    likelihoods, weights = draw.logs(1 + k, p), draw.rng.dirichlet(np.ones(1 + k), batch) * (draw.rng.random(1 + k) < 0.8)
    if possible != "all":
        likelihoods = np.where((draw.rng.random(p) < 0.3) | (possible == "none"), -np.inf, likelihoods)
    with np.errstate(invalid="ignore"):
        log_weights = draw.logs(p)
        agree(
            "reweigh_particles",
            log_weights - reference.log_sum(log_weights)[..., None],
            likelihoods,
            draw.logs(1 + k),
            weights,
        )


@pytest.mark.parametrize(
    "flaw", [[[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]]]
)
def test_whitening_refuses_what_is_no_covariance(flaw):
    with pytest.raises(ValueError, match="cov: "):
        kernels.whiten(np.zeros((20, 2)), np.stack([np.eye(2)] * 19 + [np.array(flaw)]))
    assert np.isnan(kernels.whiten(np.array([np.nan, 0.0]), np.eye(2))[0])


@given(seeds, batches, kinds, st.integers(1, 7), states, measured, counts, st.booleans(), st.sampled_from([1.0, 1e-5]))
@pytest.mark.costly
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
@pytest.mark.costly
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
@pytest.mark.costly
def test_scores_weights_and_existence(seed, batch, kind, t, k, all_valid, evidence, exclusive):
    draw, runs = Draw(seed, (*batch, t), kind), Draw(seed + 1, batch, kind)
    loglik = np.broadcast_to(-np.exp(draw.vector(1 + k)), (*batch, t, 1 + k))
    distance = np.broadcast_to(np.exp(draw.vector(k)), (*batch, t, k))
    valid = np.ones((*batch, k), bool) | all_valid if all_valid else runs.rng.random((*batch, k)) < 0.7
    existence = np.broadcast_to(1 / (1 + np.exp(draw.vector())), (*batch, t))
    likelier = np.broadcast_to(runs.vector(1, k), (*batch, 1, k)) if evidence else None
    volume = np.broadcast_to(draw.vector(), (*batch, t))
    for density in (np.float64(-2.0), np.array(-2.0), runs.vector(1, 1), np.broadcast_to(runs.vector(1, k), (*batch, 1, k))):
        for sure in (None, draw.rng.random((*batch, t)) < 0.5):
            agree("gate_scores", loglik, distance, valid, existence, 2.0, density, likelier, sure)
    agree("sample_density", distance, valid, 2.0, volume, 0.3)
    scores = REFERENCE["gate_scores"](loglik, distance, valid, existence, 2.0, np.array(-1.0), likelier, None)
    for name in ("softmax", "one_hot"):
        agree(name, scores)
        weights = REFERENCE[name](scores)
        agree("existence", scores, weights, existence, loglik, 0.99, exclusive)


def test_a_mode_that_a_return_is_next_to_impossible_for():
    xs, Ps = np.array([[0.0], [53.54]]), np.ones((2, 1, 1))
    agree("pda_update", xs, Ps, np.zeros((1, 1)), np.eye(1), np.eye(1), 0.9, 0.99, 9.0, -2.0)


@pytest.mark.costly
@pytest.mark.parametrize("mutant", ["predict", "weighted_update", "mix_modes", "existence"])
def test_the_comparison_bites(monkeypatch, mutant):
    """A reference that is wrong by 1e-8 is told from the kernels."""
    right = REFERENCE[mutant]

    def wrong(*given):
        result = right(*given)
        name = result.__match_args__[0]
        changed = {name: getattr(result, name) * (1 + 1e-8) + 1e-8}
        return attrs.evolve(result, **changed) if attrs.has(type(result)) else result._replace(**changed)

    monkeypatch.setitem(REFERENCE, mutant, wrong)
    checks = {
        "predict": test_prediction,
        "weighted_update": test_returns_of_a_scan_and_their_mixture,
        "mix_modes": test_modes_that_interact,
        "existence": test_scores_weights_and_existence,
    }
    with pytest.raises(AssertionError):
        checks[mutant]()


@given(seeds, batches, kinds, st.integers(0, 5), counts, st.booleans())
def test_what_tracks_claim(seed, batch, kind, t, k, exclusive):
    draw = Draw(seed, batch, kind)
    weights = draw.rng.random((*batch, t, 1 + k))
    agree("claimed", draw.laid(weights / np.maximum(weights.sum(-1, keepdims=True), 1e-9), 2), exclusive)


@given(seeds, batches, st.sampled_from(["plain", "strided", "reversed", "broadcast"]), counts)
def test_weights_and_scores_of_tracks_that_may_not_exist(seed, batch, kind, k):
    draw = Draw(seed, batch, kind)
    scores, miss = draw.logs(1 + k), -np.abs(draw.logs())
    weights = np.exp(draw.logs(1 + k))
    weights = draw.laid(weights / weights.sum(-1, keepdims=True), 1)
    exists = draw.rng.choice([0.0, 1e-320, 0.3, 0.999, 1.0], batch) if batch else np.asarray(0.4)
    agree("if_existing", scores, miss, exists)
    agree("given_existence", weights, scores, np.concatenate([miss[..., None], scores[..., 1:]], axis=-1), exists)
    never = np.where(draw.rng.random(scores.shape) < 0.3, -np.inf, scores)
    agree("given_existence", weights, never, never, exists)


@given(seeds, batches, kinds, states)
def test_cancelled_digits(seed, batch, kind, n):
    draw = Draw(seed, batch, kind)
    P, F = draw.cov(n), draw.vector(n, n)
    cov = reference.propagate(P, F, np.zeros((n, n)))
    for share in (1.0, 1e-3, 1e-6, 1e-9):
        agree("cancels", P, F, share * cov)
