"""Returns that name their object: what codes say of pairs, which code a track bears, and what starts no second track."""

from itertools import permutations

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.errors import ConfigError
from vedette.tracking import State, memory_limits
from vedette.tracking.identity import FADES, STRAY, Identity, Names, after_scan, pair_evidence, taken, unnamed

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.95, "clutter_density": 1e-8}
    },
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}
KINDS = ("pda", "jpda", "gnn", "nearest", "n_scan", "k_best", "lmb")


def tracker(kind="jpda", **more):
    return vedette.build(CONFIG | {"associator": {"kind": kind}} | more)


def scan(time, z, codes=None):
    return Scan(time, "radar", Detections(z, np.ones(len(z), dtype=bool), identity=codes))


def stepped(it, scans, state=None) -> State:
    state = it.start(seed=1) if state is None else state
    for each in scans:
        state = it.step(state, each)
    return state


def oracle(how, told):
    """The probability of each code of a track, by Bayes' rule over all of them, after it took returns of these codes."""
    belief = np.full(how.codes, 1.0 / how.codes)
    for code in told:
        likely = np.full(how.codes, how.wrong / how.codes)
        likely[code] += 1.0 - how.wrong
        belief = belief * likely / np.sum(belief * likely)
        belief = 0.999 * belief + 0.001 / how.codes
    return belief


@pytest.mark.parametrize("told", [(7,), (7, 7), (7, 3), (7, 3, 7), (3, 7, 7, 7), (7, 7, 5, 3, 7)])
def test_the_code_that_a_track_bears_follows_bayes(told):
    how = Identity(wrong=0.05, codes=500)
    names = unnamed(Identity(), (1,))
    for code in told:
        names = taken(how, names, np.array([[0.0, 1.0]]), np.array([[code]]))
    wanted, seen = oracle(how, told), np.array([3, 5, 7, 9])
    ratio = how.codes * (1 - how.wrong) * wanted[seen] + how.wrong
    assert np.exp(pair_evidence(how, names, seen, (1,)))[0] == pytest.approx(ratio, rel=0.03)
    assert names.shares.sum() <= 1


def test_no_code_says_nothing_and_two_known_ones_exclude_each_other_only_where_none_is_wrong():
    names = taken(Identity(wrong=0.0), unnamed(Identity(), (2,)), np.tile([0.0, 1.0], (2, 1)), np.array([[4], [6]]))
    assert pair_evidence(Identity(wrong=0.0), names, np.array([4, 6, -1]), (2,)).tolist() == [
        [pytest.approx(np.log(1000)), -np.inf, 0.0],
        [-np.inf, pytest.approx(np.log(1000)), 0.0],
    ]
    doubted = pair_evidence(Identity(wrong=0.1), names, np.array([6]), (2,))
    assert np.isfinite(doubted).all()
    assert doubted[0, 0] == pytest.approx(np.log(0.1), abs=0.01)


def test_a_miss_and_a_return_without_a_code_leave_what_is_known():
    how = Identity()
    names = taken(how, unnamed(Identity(), (1,)), np.array([[0.0, 1.0]]), np.array([[4]]))
    for weights, codes in (([1.0, 0.0], [4]), ([0.0, 1.0], [-1]), ([1.0], [])):
        after = taken(how, names, np.array([weights]), np.array([codes], dtype=int).reshape(1, -1))
        assert np.array_equal(after.shares, names.shares)


def test_a_track_bears_a_code_that_is_likelier_than_not():
    """And a return of it counts against those that it did not take only if it is its own more likely than not."""
    names = Names(np.array([[7, 3, -1]] * 2), np.array([[0.49, 0.4, 0.0], [0.51, 0.4, 0.0]]), np.array([2.0, 2.0]))
    assert names.borne.tolist() == [-1, 7]
    for weight, left in ((0.49, 1.0), (0.51, FADES)):
        after = taken(Identity(), names, np.tile([1.0 - weight, weight], (2, 1)), np.array([[7], [7]]))
        assert after.stray.tolist() == [2.0, 2.0 * left]


def test_the_count_of_stray_returns_begins_again_once_it_was_full():
    for before, after in ((0.0, 1.0), (STRAY - 1.0, STRAY), (STRAY, 0.0)):
        names = Names(np.array([[7, -1, -1]]), np.array([[1.0, 0.0, 0.0]]), np.array([before]))
        seen = Detections(np.array([[1.0, 2.0]]), np.array([True]), identity=np.array([7]))
        found = after_scan(Identity(), names, seen, np.array([[1.0, 0.0]]), None, np.zeros(1))
        assert found.stray.tolist() == [after]


@pytest.mark.parametrize("kind", KINDS)
def test_returns_without_codes_are_as_without_identity(kind):
    rng, it = np.random.default_rng(3), tracker(kind)
    spots = [rng.normal(0, 20, (3, 2)) for _ in range(12)]
    plain = stepped(it, [scan(float(i), z) for i, z in enumerate(spots)])
    coded = stepped(it, [scan(float(i), z, [-1, None, np.nan]) for i, z in enumerate(spots)])
    assert plain.ids.tolist() == coded.ids.tolist()
    assert np.array_equal(it.estimate(plain).mean, it.estimate(coded).mean)
    assert np.array_equal(plain.existence, coded.existence)
    assert plain.identity is None
    assert set(coded.identity.tolist()) <= {-1}


def beside_each_other(seed, wrong=0.0):
    """Scans of two targets that fly beside each other within their errors, then part, in any order of returns."""
    rng = np.random.default_rng(seed)
    for i in range(40):
        apart = max(60.0 - 4.0 * i, 1.0, 4.0 * (i - 25))
        z = np.array([[8.0 * i, apart], [8.0 * i, -apart]]) + rng.normal(0, 5, (2, 2))
        codes = np.where(rng.random(2) < wrong, rng.permutation([70, 80]), [70, 80])
        order = rng.permutation(2)
        yield scan(float(i), z[order], codes[order])


def kept_apart(it, scans):
    """Return whether the two targets have the same tracks at the end as before they met."""
    scans = list(scans)
    before = stepped(it, scans[:6])
    after = stepped(it, scans[6:], before)
    upper = [int(state.ids[np.argmax(it.estimate(state).mean[:, 1])]) for state in (before, after)]
    return len(before.ids) == 2 and len(after.ids) == 2 and upper[0] == upper[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_codes_keep_targets_apart_that_their_positions_do_not(kind):
    it = tracker(kind, gate={"probability": 0.9999}, identity={"wrong": 0.1})
    switched = [not kept_apart(it, _hidden(beside_each_other(seed))) for seed in range(5)]
    assert any(switched), "a scene that needs codes"
    assert all(kept_apart(it, beside_each_other(seed)) for seed in range(2))
    assert all(kept_apart(it, beside_each_other(seed, wrong=0.1)) for seed in range(3))


def _hidden(scans):
    return [Scan(s.time, "radar", Detections.of(s.detections.z)) for s in scans]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_names_and_orders_are_free(kind):
    """Other codes for the same objects, and returns in another order, change no estimate."""
    it, scans = tracker(kind), list(beside_each_other(2))
    plain = stepped(it, scans)
    other = [scan(s.time, s.detections.z[::-1], s.detections.identity[::-1] * 3 + 5) for s in scans]
    again = stepped(it, other)
    plainly = dict(zip((3 * plain.identity + 5).tolist(), it.estimate(plain).mean, strict=True))
    for code, mean in zip(again.identity.tolist(), it.estimate(again).mean, strict=True):
        assert mean == pytest.approx(plainly[code], abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_a_code_that_a_track_bears_starts_no_second_track(kind):
    it = tracker(kind)
    state = stepped(it, [scan(float(i), [[8.0 * i, 0.0]], [7]) for i in range(6)])
    assert stepped(it, [scan(6.0, [[900.0, 900.0]], [7])], state).born == state.born
    assert stepped(it, [scan(6.0, [[900.0, 900.0]], [8])], state).born == state.born + 1
    assert stepped(it, [scan(6.0, [[900.0, 900.0]], [-1])], state).born == state.born + 1
    assert stepped(it, [scan(6.0, [[900.0, 900.0], [990.0, 0.0]], [8, 8])], state).born == state.born + 1


def shared(it, scans=20):
    """Two targets far apart that bear one code."""
    return stepped(it, [scan(float(i), [[8.0 * i, 0.0], [900.0, 900.0 - 8.0 * i]], [7, 7]) for i in range(scans)])


@pytest.mark.parametrize("kind", KINDS)
def test_a_code_that_two_targets_share_hides_neither_unless_none_may_be_wrong(kind):
    both = shared(tracker(kind))
    assert both.identity[both.confirmed].tolist() == [7, 7]
    assert len(shared(tracker(kind, identity={"wrong": 0.0})).ids) == 1


def test_pairs_within_gates_weigh_codes_as_all_pairs_do(monkeypatch):
    it, scans = tracker("jpda"), list(beside_each_other(4, wrong=0.1))
    first, whole = stepped(it, scans[:1]), stepped(it, scans)
    monkeypatch.setattr(memory_limits, "LEAST_PAIRS", 0)
    monkeypatch.setattr("vedette.tracking.meeting.FEW", 0)
    few = stepped(it, scans[1:], first)
    assert few.returns is not None
    assert few.ids.tolist() == whole.ids.tolist()
    assert it.estimate(few).mean == pytest.approx(it.estimate(whole).mean, abs=1e-9)
    assert few.names.shares == pytest.approx(whole.names.shares, abs=1e-9)


def test_a_batch_weighs_codes_as_each_run_alone_does():
    it = vedette.build(
        CONFIG | {"associator": {"kind": "jpda"}, "birth": {"kind": "given"}, "lifecycle": {"kind": "single_target"}}
    )
    rng = np.random.default_rng(5)
    mean = np.zeros((3, 2, 4))
    mean[..., 1, 1] = 4.0
    prior = Gaussian(mean, np.broadcast_to(np.diag([25.0, 25.0, 4.0, 4.0]), (3, 2, 4, 4)).copy())
    z, codes = rng.normal(0, 5, (6, 3, 3, 2)), rng.choice([-1, 7, 8], (6, 3, 3))
    valid = np.ones((3, 3), dtype=bool)
    batch = it.start(prior, 0.0)
    for i in range(6):
        batch = it.step(batch, Scan(1.0 + i, "radar", Detections(z[i], valid, identity=codes[i])))
    for run in range(3):
        alone = it.start(Gaussian(prior.mean[run], prior.cov[run]), 0.0)
        for i in range(6):
            alone = it.step(alone, Scan(1.0 + i, "radar", Detections(z[i, run], valid[run], identity=codes[i, run])))
        assert it.estimate(batch).mean[run] == pytest.approx(it.estimate(alone).mean, abs=1e-12)
        assert batch.names.shares[run] == pytest.approx(alone.names.shares, abs=1e-12)


def test_two_returns_and_two_tracks_are_weighed_as_all_joint_events_are():
    how, names = Identity(wrong=0.2, codes=20), Names(np.array([[7, -1, -1], [8, -1, -1]]), np.tile([0.9, 0.0, 0.0], (2, 1)))
    evidence = np.exp(pair_evidence(how, names, np.array([8, 7]), (2,)))
    given = vedette.build(
        CONFIG
        | {"associator": {"kind": "jpda"}, "birth": {"kind": "given"}, "gate": "off"}
        | {"lifecycle": {"kind": "existence"}, "identity": {"wrong": 0.2, "codes": 20}}
    )
    state = given.start(Gaussian(np.array([[0.0, 0, 0, 0], [3.0, 0, 0, 0]]), np.tile(25 * np.eye(4), (2, 1, 1))), 0.0)
    named = State(**{each: getattr(state, each) for each in State.__slots__ if each != "__weakref__"} | {"names": names})
    z = [[1.0, 0.0], [2.0, 0.0]]
    plain, coded = (given.step(one, scan(1.0, z, codes)) for one, codes in ((state, None), (named, [8, 7])))
    score = np.log(evidence)
    # Of the plain weights' joint events, each is multiplied by the evidence of its pairs.
    events = {}
    meets = given.expect(state, scan(1.0, z))
    loglik = meets.innovation.loglik
    clutter = np.log(1e-8)
    for first, second in [(0, 0), (0, 1), (0, 2), (1, 0), (2, 0), *permutations((1, 2))]:
        total = loglik[0, first] + loglik[1, second]
        total += sum(score[row, pick - 1] - clutter for row, pick in ((0, first), (1, second)) if pick)
        events[first, second] = total
    top = max(events.values())
    weights = np.zeros((2, 3))
    for (first, second), total in events.items():
        weights[0, first] += np.exp(total - top)
        weights[1, second] += np.exp(total - top)
    assert coded.weights == pytest.approx(weights / weights.sum(axis=1, keepdims=True), abs=1e-9)
    assert np.abs(coded.weights - plain.weights).max() > 0.1


def test_tracks_carry_their_codes_and_what_lies_outside_is_counted():
    from vedette.tracking import History, Intake

    it = tracker()
    history, intake, state = History(it), Intake(it.sensors), it.start()
    for i in range(12):
        z, codes = [[8.0 * i, 0.0]], [7]
        if i in (5, 8):
            z, codes = [*z, [900.0, 900.0]], [7, 7]
        each = scan(float(i), z, codes if i else None)
        after = it.step(state, each)
        history.add(after)
        intake.add(each, state, after)
        state = after
    (track,) = history.tracks()
    assert track.identity.tolist() == [-1, *11 * [7]]
    assert intake.outside == 2


@pytest.mark.parametrize(
    ("parameters", "place"),
    [({"wrong": 1.5}, "identity.wrong"), ({"codes": 1}, "identity.codes"), ({"rong": 0}, "identity.rong")],
)
def test_wrong_parameters_are_refused_by_place(parameters, place):
    with pytest.raises(ConfigError) as caught:
        tracker(identity=parameters)
    assert [problem.place for problem in caught.value.problems] == [place]


@pytest.mark.parametrize("codes", [[1.5, 2.0], ["a", "b"], [[1, 2]], [1, 2, 3]])
def test_wrong_codes_are_refused(codes):
    it = tracker()
    with pytest.raises((ValueError, vedette.ScanRefused), match="identity"):
        it.step(it.start(), scan(0.0, [[0.0, 0.0], [1.0, 1.0]], codes))
