"""Wrong associators."""

from functools import partial
from itertools import product

import numpy as np

import vedette_bayes_risk as bayes_risk
import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

PDA = partial(standard.Pda)
JPDA = partial(standard.Jpda)
GNN = partial(standard.GlobalNearest)
NEAREST = partial(standard.Nearest)
RISK = partial(bayes_risk.BayesRisk)


def _softmax(scores, axis=-1):
    likelihood = np.exp(scores - scores.max(axis=axis, keepdims=True))
    return likelihood / likelihood.sum(axis=axis, keepdims=True)


def _one_hot(best, scores):
    return (np.arange(scores.shape[-1]) == best[..., None]).astype(float)


def _each_run(solve):
    """Return an `associate` that solves run by run."""

    def associate(right, scores, evidence):
        if not scores.size:
            return right.associate(scores, evidence)
        runs = scores.reshape(-1, *scores.shape[-2:])
        return np.array([solve(run) for run in runs]).reshape(scores.shape)

    return associate


def _returns_alone(right, scores, evidence):
    if scores.shape[-1] == 1:
        return right.associate(scores, evidence)
    seen = right.associate(scores, evidence)
    total = seen[..., 1:].sum(axis=-1, keepdims=True)
    return np.where(total > 0, np.concatenate([0 * total, seen[..., 1:] / np.maximum(total, 1e-300)], axis=-1), seen)


def _plain_exponentials(right, scores, evidence):
    with np.errstate(over="ignore", invalid="ignore"):
        likelihood = np.exp(scores)
        return likelihood / likelihood.sum(axis=-1, keepdims=True)


def _over_tracks(right, scores, evidence):
    return _softmax(scores, axis=-2) if scores.size else scores


def _miss_twice(right, scores, evidence):
    doubled = np.array(scores)
    doubled[..., 0] += np.log(2.0)
    return right.associate(doubled, evidence)


def _small_dropped(right, scores, evidence):
    weights = right.associate(scores, evidence)
    return np.where(weights < 0.01, 0.0, weights)


def _forbidden_a_little(right, scores, evidence):
    weights = right.associate(scores, evidence) + 1e-4
    return weights / weights.sum(axis=-1, keepdims=True)


def _evidence_twice(right, scores, evidence):
    if evidence is None:
        return right.associate(scores, None)
    return right.associate(np.concatenate([scores[..., :1], scores[..., 1:] + evidence], axis=-1), evidence)


def _in_place(right, scores, evidence):
    scores -= scores.max(axis=-1, keepdims=True, initial=-np.inf)
    return right.associate(scores, evidence)


def _smoothed_over_scans():
    """Return an `associate` that blends in the weights of the call before, if of the same shape."""
    kept = {}

    def associate(right, scores, evidence):
        weights = right.associate(scores, evidence)
        before = kept.get(scores.shape, weights)
        kept[scores.shape] = weights
        return 0.8 * weights + 0.2 * before

    return associate


def _first_run(right, scores, evidence):
    if not scores.size:
        return right.associate(scores, evidence)
    runs = scores.reshape(-1, *scores.shape[-2:])
    return np.broadcast_to(right.associate(runs[0], None), scores.shape).copy()


def _in_turn(run):
    """The tracks choose one after the other: later ones get what the earlier ones left."""
    left, rows = np.ones(run.shape[1] - 1), []
    for row in run:
        likelihood = np.exp(row - row.max()) * np.append(1.0, left)
        weights = likelihood / likelihood.sum()
        left = np.maximum(left - weights[1:], 0.0)
        rows.append(weights)
    return np.array(rows).reshape(run.shape)


def _scaled_down(right, scores, evidence):
    """Each return's claims are divided by their total, if above 1; the rest is missed."""
    weights = _softmax(scores)
    claims = weights[..., 1:] / np.maximum(weights[..., 1:].sum(axis=-2, keepdims=True), 1.0)
    return np.concatenate([1.0 - claims.sum(axis=-1, keepdims=True), claims], axis=-1)


def _cheap(right, scores, evidence):
    best = np.max(scores, axis=-1, keepdims=True)
    g = np.exp(scores[..., 1:] - np.maximum(scores[..., :1], best - 500.0))
    claimed = g / (g.sum(axis=-1, keepdims=True) + g.sum(axis=-2, keepdims=True) - g + 1.0)
    return np.concatenate([1.0 - claimed.sum(axis=-1, keepdims=True), claimed], axis=-1).clip(0.0)


def _marginals(allowed):
    """Return the marginals over all joint associations that are `allowed`; at most 4 tracks and 5 columns."""

    def solve(run):
        if run.shape[0] > 4 or run.shape[1] > 5:
            return standard.Jpda().associate(run, None)
        joint = [pick for pick in product(range(run.shape[1]), repeat=run.shape[0]) if allowed(pick)]
        logs = np.array([sum(run[t, i] for t, i in enumerate(pick)) for pick in joint])
        prob = _softmax(logs)
        weights = np.zeros(run.shape)
        for pick, p in zip(joint, prob, strict=True):
            weights[np.arange(len(pick)), list(pick)] += p
        return weights

    return solve


def _claimed_at_most_twice(pick):
    return all(pick.count(i) <= 2 for i in pick if i)


def _one_may_miss(pick):
    return len(set(pick)) == len(pick) or set(pick) == {0}


def _greedy(run):
    best, taken = np.zeros(len(run), dtype=int), set()
    gain = run[:, 1:] - run[:, :1]
    pairs = zip(*np.unravel_index(np.argsort(-gain, axis=None), gain.shape), strict=True)
    for t, i in pairs:
        if gain[t, i] > 0 and best[t] == 0 and i not in taken:
            best[t] = i + 1
            taken.add(i)
    return _one_hot(best, run)


def _worst(right, scores, evidence):
    finite = np.where(np.isfinite(scores), -scores, scores)
    return right.associate(finite, evidence)


def _miss_scores_ignored(right, scores, evidence):
    return right.associate(np.concatenate([0 * scores[..., :1], scores[..., 1:]], axis=-1), evidence)


def _forbidden_is_ten(right, scores, evidence):
    return right.associate(np.nan_to_num(scores, neginf=-10.0), evidence)


def _last_of_equals(right, scores, evidence):
    return _one_hot(scores.shape[-1] - 1 - np.argmax(scores[..., ::-1], axis=-1), scores)


def _all_of_equals(right, scores, evidence):
    return (scores == scores.max(axis=-1, keepdims=True)).astype(float)


def _nearest_index(right, scores, evidence):
    some = scores.shape[-1] > 1
    return _one_hot(1 + np.argmax(scores[..., 1:], axis=-1) if some else np.zeros(scores.shape[:-1]), scores)


def _outside_the_gate(right, scores, evidence):
    return right.associate(np.where(np.isfinite(scores), scores, -1.0), evidence)


associator = partial(mutant, "associator")

MUTANTS: tuple[Mutant, ...] = (
    associator("pda_never_misses", "The miss gets no weight where there is a return.", PDA, associate=_returns_alone),
    associator(
        "pda_overflows", "exp of the scores, without the largest taken out first.", PDA, associate=_plain_exponentials
    ),
    associator("pda_over_tracks", "The sum runs over tracks, not over columns.", PDA, associate=_over_tracks),
    associator("pda_miss_twice", "The miss weighs twice what it should.", PDA, associate=_miss_twice),
    associator(
        "pda_small_dropped", "Weights below .01 are set to 0, and the rest is not normalised.", PDA, associate=_small_dropped
    ),
    associator(
        "pda_forbidden_a_little", "Every column gets 1e-4 more, forbidden ones too.", PDA, associate=_forbidden_a_little
    ),
    associator("pda_evidence_twice", "The evidence, which the scores hold, is added again.", PDA, associate=_evidence_twice),
    associator("pda_in_place", "The scores that are passed in are changed.", PDA, associate=_in_place),
    associator(
        "pda_smoothed_over_scans", "The weights of the call before are blended in.", PDA, associate=_smoothed_over_scans()
    ),
    associator("pda_first_run", "In a batch all runs get the weights of the first one.", PDA, associate=_first_run),
    associator(
        "pda_half_temperature",
        "The scores are halved: weights are roots.",
        PDA,
        label="other_model",
        solves="",
        associate=lambda r, s, e: r.associate(s / 2, e),
    ),
    associator(
        "jpda_as_pda",
        "Each track is alone, and no return is said to be claimed twice.",
        JPDA,
        associate=lambda r, s, e: _softmax(s),
    ),
    associator(
        "jpda_in_turn", "Tracks choose in their order: the first has the choice.", JPDA, associate=_each_run(_in_turn)
    ),
    associator(
        "jpda_scaled_down",
        "PDA's weights, scaled down until no return is claimed twice.",
        JPDA,
        label="other_model",
        solves="",
        associate=_scaled_down,
    ),
    associator("jpda_cheap_as_exact", "Fitzgerald's approximation that says it is exact.", JPDA, associate=_cheap),
    associator(
        "jpda_twice",
        "A return may be claimed by two tracks, not by three.",
        JPDA,
        associate=_each_run(_marginals(_claimed_at_most_twice)),
    ),
    associator(
        "jpda_one_may_miss",
        "Column 0 can be taken by one track only, unless all miss.",
        JPDA,
        associate=_each_run(_marginals(_one_may_miss)),
    ),
    associator(
        "jpda_approximates_silently",
        "Belief propagation for every cluster, and it says that it approximates nothing.",
        JPDA,
        approximates=lambda r: False,
        associate=lambda r, s, e: standard.Jpda(exact=0).associate(s, e),
    ),
    associator("gnn_greedy", "The best pair first, then the next: not the best total.", GNN, associate=_each_run(_greedy)),
    associator("gnn_worst", "The sign of the cost is lost: it takes the worst assignment.", GNN, associate=_worst),
    associator("gnn_miss_scores_ignored", "A miss is worth 0 whatever its score.", GNN, associate=_miss_scores_ignored),
    associator(
        "gnn_forbidden_is_ten",
        "Forbidden pairs get a score of -10 and are taken if nothing is better.",
        GNN,
        associate=_forbidden_is_ten,
    ),
    associator(
        "nearest_last", "Between equal scores the last is taken.", NEAREST, label="other_model", associate=_last_of_equals
    ),
    associator("nearest_all_of_equals", "Equal scores each get weight 1.", NEAREST, associate=_all_of_equals),
    associator(
        "nearest_never_misses",
        "The best return is taken even if the miss scores higher or it is forbidden.",
        NEAREST,
        associate=_nearest_index,
    ),
    associator(
        "nearest_exclusive", "The nearest neighbour declares that no return is claimed twice.", NEAREST, exclusive=True
    ),
    associator("risk_outside_the_gate", "Returns outside the gate get weight.", RISK, associate=_outside_the_gate),
    associator(
        "risk_evidence_sign",
        "The evidence counts with the wrong sign.",
        RISK,
        associate=lambda r, s, e: r.associate(s, None if e is None else -e),
    ),
    associator(
        "risk_needs_evidence",
        "A scan without evidence raises an error.",
        RISK,
        associate=lambda r, s, e: r.associate(s, e + 0.0),
    ),
)
