"""Components of the supporting roles that break what their parameters' names promise, or what only a longer look shows."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from support.mutants.parts import changed
from support.mutants.preprocessors import remade
from support.mutants.sources import SCENE, rescanned
from vedette import Detections, Gaussian
from vedette.sampling import Bounds
from vedette.testing.laws.source import OTHER
from vedette.testing.strategies import SENSOR
from vedette_sim import Look, Simulation
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.intensity import Intensity
from vedette_standard.births.places import Appearance
from vedette_standard.births.poisson import Poisson
from vedette_standard.births.uniform import Uniform
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.score import Score
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.cartesian_position import CartesianPosition

CP, UC = CartesianPosition, UnbiasedConversion

SPREAD = {"spread": st.just({"vx": 5.0, "vy": 5.0})}
BOX = {
    "view": st.just({"x": Bounds(-500.0, 500.0),
                     "y": Bounds(-400.0, 400.0)}),
    "spread": st.just({"vx": 5.0, "vy": 5.0}),
    "initial": st.just(2.0), "rate": st.just(0.1), "lifetime": st.just(100.0),
}  # fmt: skip


AROUND = Appearance({"x": (0.0, 100.0), "y": (0.0, 100.0), "vx": (0.0, 99.0), "vy": (0.0, 99.0)}, 2.0, 0.01)
HERE = {"appear": st.just((AROUND,)), "enter": st.just(()), "sensors": st.just(())}


def begun(base, change):
    return {"begin": lambda s, f, e, o, n, d, c: change(base.begin(s, f, e, o, n, d, c), s)}


def blind(self, found, estimator, sensor, name, detections, claimed):
    """Bearings alone start nothing, silently."""
    try:
        return FromReturns.begin(self, found, estimator, sensor, name, detections, claimed)
    except (ValueError, NotImplementedError):
        return FromReturns.begin(self, found, estimator, CP(5.0), name, Detections.of(np.zeros((0, 2)), 2), claimed[:0])


def noises_in_a_row(self, found, estimator, sensor, name, detections, claimed):
    """The j-th new track has the noise of the j-th return, whichever it started from."""
    made = FromReturns.begin(self, found, estimator, sensor, name, detections, claimed)
    if detections.noise is None:
        return made
    cov = np.array(made.prior.cov)
    cov[:, :2, :2] = detections.noise[: len(cov)]
    return evolve(made, prior=Gaussian(made.prior.mean, cov))


PLAIN = Kalman(ConstantVelocity(0.5))

BIRTHS = [
    ("the axes of the sensor taken for the first", FromReturns, "axes_are_found_by_name",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, PLAIN, o, n, d, c)}, SPREAD),
    ("noises by the number of the track", FromReturns, "each_return_has_its_own_noise", {"begin": noises_in_a_row}, SPREAD),
    ("tracks from what is missing", FromReturns, "what_is_missing_says_nothing",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, e, o, n, evolve(d, missing=None), c)}, SPREAD),
    ("fades once a scan", Uniform, "the_unseen_come_and_go_with_time",
     {"predict": lambda s, m, e, dt, rng: s.rate * s.lifetime + (m - s.rate * s.lifetime) * np.exp(-1.0 / s.lifetime)},
     BOX | {"initial": st.just(10.0)}),
    ("a return's own noise ignored", FromReturns, "a_sharper_return_starts_a_surer_track",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, e, o, n, evolve(d, noise=None), c)}, SPREAD),
    ("bearings start nothing, silently", FromReturns, "refuses_what_starts_no_track", {"begin": blind}, SPREAD),
    ("spread taken for a variance", FromReturns, "spread_as_stated",
     begun(FromReturns, lambda made, s: evolve(made, prior=Gaussian(made.prior.mean, changed(made.prior.cov, lambda P: (
         P.__setitem__((..., 2, 2), 5.0)))))), SPREAD),
    ("surer than stated", FromReturns, "exists_as_stated",
     begun(FromReturns, lambda made, s: evolve(made, existence=0.5 + 0.5 * made.existence)),
     SPREAD | {"initial": st.just(0.2)}),
    ("less sure than every track is said to be", FromReturns, "exists_as_stated",
     begun(FromReturns, lambda made, s: evolve(made, existence=0.5 * made.existence)), SPREAD | {"initial": st.just(0.2)}),
    ("starts from any sensor", FromReturns, "starts_from_its_sensors", {"starts_from": lambda s, name: True},
     SPREAD | {"sensors": st.just(("radar",))}),
    ("a look thins nothing", Uniform, "a_look_thins_the_unseen", {"update": lambda s, m, e, o, d, c, g: m}, BOX),
    ("comes once a scan", Uniform, "the_unseen_come_and_go_with_time",
     {"predict": lambda s, m, e, dt, rng: np.asarray(m + s.rate)}, BOX),
    ("the unseen never leave", Poisson, "the_unseen_fade",
     {"predict": lambda s, m, e, dt, rng: Poisson.predict(Poisson(s.appear, lifetime=1e9), m, e, dt, rng)}, HERE),
    ("those who come never leave within a step", Uniform, "the_unseen_settle",
     {"predict": lambda s, m, e, dt, rng: np.asarray(m * np.exp(-dt / s.lifetime) + s.rate * dt)}, BOX),
    ("the unseen stand still", Poisson, "the_unseen_move",
     {"predict": lambda s, m, e, dt, rng: Intensity(m.number * np.exp(-dt / s.lifetime), m.belief, m.place)}, HERE),
    ("rates in another unit", Uniform, "rates_are_densities",
     {"reveal": lambda s, m, e, o, d, g: (lambda r: (-np.ones(len(d.z)), r[1]))(Uniform.reveal(s, m, e, o, d, g))}, BOX),
    ("clutter forgotten", Uniform, "a_track_of_the_unseen_exists_by_their_density",
     begun(Uniform, lambda made, s: evolve(made, existence=np.ones(len(made.returns)))), BOX),
]  # fmt: skip


def reviewed(base, change):
    return {"review": lambda s, m, r: change(base.review(s, m, r), r)}


@frozen(eq=False)
class Kept:
    """A memory and all scans since."""

    memory: object
    scans: np.ndarray


def remembers_all(self, memory, scan):
    kept = memory if isinstance(memory, Kept) else Kept(memory, np.zeros((*scan.hit.shape, 0)))
    after, confirmed, alive = MOfN.review(self, kept.memory, scan)
    return Kept(after, np.concatenate([kept.scans, scan.hit[..., None]], axis=-1)), confirmed, alive


FEW = {"hits": st.just(3), "looks": st.just(5), "misses": st.just(4), "worth": st.just(0.1)}
LIMITED = FEW | {
    "max_out_of_coverage": st.just(30.0), "max_without_detection": st.just(50.0), "max_spread": st.just(100.0),
}  # fmt: skip
COVERED = FEW | {"max_out_of_coverage": st.just(30.0), "max_without_detection": st.none()}

LIFECYCLES = [
    ("a track ends at its 40th hit", MOfN, "found_tracks_live",
     {"review": lambda s, m, r: (lambda a: (a[0], a[1], a[2] & (a[0].own.looks < 40)))(MOfN.review(s, m, r))}, FEW),
    ("any hit counts", MOfN, "next_to_no_hit_is_none",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, hit=(r.hit > 0).astype(float)))}, FEW),
    ("scans out of coverage are counted", MOfN, "waiting_in_parts_is_waiting",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, dt=r.dt if r.p_detect.any() else 1.0))}, COVERED),
    ("a new track's looks elsewhere are misses", MOfN, "waiting_in_parts_is_waiting",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, p_detect=np.where(m.own.confirmed, r.p_detect, 0.9)))}, COVERED),
    ("a new track's looks elsewhere are misses, by no time", MOfN, "a_look_at_nothing_keeps_the_verdict",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, p_detect=np.where(m.own.confirmed, r.p_detect, 0.9)))}, FEW),
    ("not confirmed while out of sight", MOfN, "a_look_at_nothing_keeps_the_verdict",
     reviewed(MOfN, lambda a, r: (a[0], a[1] & (r.p_detect > 0), a[2])), FEW),
    ("looks elsewhere are misses", MOfN, "a_look_at_nothing_keeps_the_verdict",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, p_detect=np.maximum(r.p_detect, 0.5)))}, FEW),
    ("a look elsewhere ends what is not confirmed", MOfN, "a_look_at_nothing_keeps_the_verdict",
     reviewed(MOfN, lambda a, r: (a[0], a[1], a[2] & (a[1] | (r.p_detect > 0)))), FEW),
    ("a look elsewhere is a miss", MOfN, "confirms_after_hits",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, p_detect=np.maximum(r.p_detect, 0.9)))},
     FEW | {"looks": st.just(3)}),
    ("keeps every scan", MOfN, "memory_does_not_grow", {"review": remembers_all}, FEW),
    ("spread not asked for", MOfN, "asks_for_what_it_uses",
     {"needs_spread": property(lambda s: False)}, LIMITED),
    ("confirms by hits alone", Existence, "what_does_not_exist_is_not_confirmed",
     reviewed(Existence, lambda a, r: (a[0], r.hit > 0.5, a[2] | (r.hit > 0.5))), {}),
    ("coverage waits twice as long", MOfN, "waits_out_of_coverage",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, dt=0.5 * r.dt))}, COVERED),
    ("waits for ever", MOfN, "waits_without_detection",
     reviewed(MOfN, lambda a, r: (a[0], a[1], a[2] | True)), LIMITED),
    ("spread in another unit", MOfN, "keeps_to_max_spread",
     {"review": lambda s, m, r: MOfN.review(s, m, evolve(r, spread=None if r.spread is None else r.spread / 1e3))},
     LIMITED),
    ("one miss is forgiven", MOfN, "misses_in_a_row",
     {"review": lambda s, m, r: (lambda a: (a[0], a[1], a[2] | (a[0].own.hits & 64 > 0)))(MOfN.review(s, m, r))}, FEW),
    ("one miss too many", MOfN, "misses_in_a_row",
     {"review": lambda s, m, r: MOfN.review(MOfN(hits=s.hits, looks=s.looks, misses=s.misses + 1, worth=s.worth), m, r)},
     FEW),
    ("the first hit not counted", MOfN, "confirms_after_hits",
     {"start": lambda s, e: (lambda m: evolve(m, own=evolve(m.own, hits=0 * m.own.hits)))(MOfN.start(s, e))}, FEW),
    ("the fall counted from 0", Score, "falls_by_its_drop",
     reviewed(Score, lambda a, r: (evolve(a[0], own=evolve(a[0].own, fell=np.maximum(-a[0].own.last, 0.0))), a[1], a[2])),
     {"drop": st.just(5.0)}),
    ("fades in half of its lifetime", Existence, "survives_its_lifetime",
     {"predict": lambda s, e, dt: Existence.predict(s, e, 2 * dt)}, {}),
]  # fmt: skip


PREPROCESSORS = [
    ("x and y exchanged", UC, "returns_lie_where_they_were_seen", remade(lambda d: evolve(d, z=d.z[..., ::-1])), {}),
    ("returns' own noise ignored", UC, "sharper_returns_make_sharper_ones",
     {"process": lambda s, scans: UC.process(s, {n: evolve(x, detections=evolve(x.detections, noise=None))
                                                 for n, x in scans.items()})}, {}),
    ("the platform forgotten", UC, "placed_scans_are_placed",
     {"process": lambda s, scans: UC.process(s, {n: evolve(x, pose=None) for n, x in scans.items()})}, {}),
]  # fmt: skip


def moved(scan):
    return evolve(scan, detections=Detections(scan.detections.z + 500.0, scan.detections.valid))


LONG = SCENE | {"duration": st.just(30.0)}
SOURCES = [
    ("one seed for all", Simulation, "every_generator_its_own",
     {"open": lambda s, sensors, rng: Simulation.open(s, sensors, np.random.default_rng(1))}, SCENE),
    ("times in ms", Simulation, "scans_last_as_stated",
     rescanned(lambda scans: [evolve(scan, time=1000 * scan.time) for scan in scans]), SCENE),
    ("sensor by sensor", Simulation, "scans_come_in_time_order",
     rescanned(lambda scans: sorted(scans, key=lambda scan: scan.sensor)),
     SCENE | {"looks": st.just({name: Look(interval=1.0) for name in (SENSOR, OTHER)})}),
    ("each scan twice", Simulation, "scans_come_once",
     rescanned(lambda scans: [scan for scan in scans for _ in range(2)]), SCENE),
    ("returns lie elsewhere", Simulation, "returns_are_of_the_truth",
     rescanned(lambda scans: [moved(scan) for scan in scans]), LONG),
]  # fmt: skip

PROMISES_SUPPORTING = [*BIRTHS, *LIFECYCLES, *PREPROCESSORS, *SOURCES]
