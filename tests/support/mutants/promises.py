"""Components of several roles that break what their parameters' names promise, or what only a longer look shows."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from support.mutants.mixtures import TWO
from support.mutants.parts import changed, put
from support.mutants.sources import SCENE
from vedette import Detections, Gaussian
from vedette.sampling import Bounds
from vedette.types import Recording
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_sim import Simulation
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.places import Appearance
from vedette_standard.births.poisson import Intensity, Poisson
from vedette_standard.births.uniform import Uniform
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.score import Score
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.product import Product
from vedette_standard.motion.random_walk import RandomWalk
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RB, CP, CV, EKF, UC = RangeBearing, CartesianPosition, ConstantVelocity, ExtendedKalman, UnbiasedConversion
LINEAR = {"motion": st.just(CV(0.5))}

APART = {"models": st.just((CV(0.5), RandomWalk(axes=("b",), sigma=1.0)))}
MOTION = [
    ("velocity in km/h", CV, "velocities_move_their_positions",
     {"move": lambda s, x, dt: CV.move(s, x * [1, 1, 1 / 3.6, 1 / 3.6], dt) * [1, 1, 3.6, 3.6],
      "jacobian": lambda s, x, dt: CV.jacobian(s, x, dt) * np.where(np.eye(4, k=2), 1 / 3.6, 1.0)}, {}),
    ("the first model for all", Product, "parts_keep_their_own",
     {"noise": lambda s, x, dt: put(Product.noise(s, x, dt), 4, 4, Product.noise(s, x, dt)[..., 2, 2])}, APART),
]  # fmt: skip


def not_there(sensor, x):
    return np.where(x[..., :1] > 0, RB.measure(sensor, x), np.nan)


def at(change):
    """A platform's pose, changed on the way in."""
    return {"at": lambda s, pose: type(s).__mro__[1].at(s, change(pose))}


SPREAD_OUT = {"clutter_per_scan": st.just(5.0), "max_range": st.just(3000.0), "clutter_density": st.just(0.0)}
RANGED = {"max_range": st.just(900.0), "min_range": st.just(0.0)}


def spot(change):
    """Information, score and ratio of a camera, changed."""
    return {"information": lambda s, x, frame, at: change(*GaussianSpot.information(s, x, frame, at))}


SENSORS = [
    ("no bearing behind", RB, "gives_finite_numbers", {"measure": not_there}, {}),
    ("x counts to the left", CP, "names_mean_the_same",
     {"measure": lambda s, x: x * [-1, 1], "jacobian": lambda s, x: np.diag([-1.0, 1.0])}, {}),
    ("inverse with the noise of two returns", RB, "a_sharp_return_inverts_exactly",
     {"invert": lambda s, z, noise=None: (lambda g: Gaussian(g.mean, 2 * g.cov))(RB.invert(s, z, noise))}, {}),
    ("inverse of fixed noise", RB, "the_usual_noise_is_the_sensors",
     {"invert": lambda s, z, noise=None: RB.invert(s, z, 4 * s.noise(np.zeros(2)) if noise is None else noise)}, {}),
    ("the platform's heading ignored", RB, "sees_from_where_it_stands",
     at(lambda pose: evolve(pose, heading=0.0 * pose.heading)), {}),
    ("the platform's place ignored", RB, "sees_from_where_it_stands",
     at(lambda pose: evolve(pose, position=0.0 * pose.position)), {}),
    ("inverse forgets the heading", RB, "inverts_where_it_stands",
     {"invert": lambda s, z, noise=None: RB.invert(
         RB(s.sigma_range, s.sigma_bearing).at(evolve(s._pose, heading=0.0 * s._pose.heading)), z, noise)}, {}),
    ("the first platform for all", RB, "platforms_in_a_batch_stand_apart",
     at(lambda pose: evolve(pose, position=pose.position[:1] + 0 * pose.position) if np.ndim(pose.position) > 1
        else pose), {}),
    ("clutter shared among returns", CP, "clutter_takes_any_number_of_returns",
     {"clutter": lambda s, z: np.full(z.shape[:-1], 1e-5) / max(z.shape[-2], 1)}, {}),
    ("clutter without its circle", RB, "false_returns_add_up",
     {"clutter": lambda s, z: 2 * np.pi * RB.clutter(s, z)}, SPREAD_OUT),
    ("sees beyond its range", RB, "detects_within_max_range",
     {"detects": lambda s, x: np.asarray(s.detection_probability)}, RANGED),
    ("score of the wrong sign", GaussianSpot, "pictures_inform", spot(lambda J, g, llr: (J, -g, llr)), {}),
    ("the ratio upside down", GaussianSpot, "pictures_show_where", spot(lambda J, g, llr: (J, g, -llr)), {}),
    ("noise is the information", GaussianSpot, "a_brighter_target_is_seen_no_worse",
     {"noise": lambda s, x: np.linalg.inv(GaussianSpot.noise(s, x))}, {}),
    ("learning moves the target", GaussianSpot, "learning_leaves_the_place",
     {"learn": lambda s, x, frame: GaussianSpot.learn(s, x, frame) + 0.1}, {}),
]  # fmt: skip


def argmax_twice(self, scores, evidence):
    """Each track that ties takes the return."""
    return np.where(scores == scores.max(axis=-1, keepdims=True), 1.0, 0.0)


def shared_without_evidence(self, scores, evidence):
    return Pda.associate(self, scores, evidence) * (1.0 if evidence is not None else 0.5)


def certain_misses(self, scores, evidence):
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.exp(scores - scores[..., :1])
        return ratio / ratio.sum(axis=-1, keepdims=True)


def crowded(self, scores, evidence):
    """Exact for few tracks; each by itself for many."""
    return Jpda.associate(self, scores, evidence) if scores.shape[-2] < 5 else Pda.associate(Pda(), scores, evidence)


ASSOCIATORS = [
    ("ties are taken by all", GlobalNearest, "settles_ties", {"associate": argmax_twice}, {}),
    ("half of it without evidence", Pda, "needs_no_evidence", {"associate": shared_without_evidence}, {}),
    ("ratios to the miss", Pda, "surely_detected_tracks_are_held", {"associate": certain_misses}, {}),
    ("each by itself in crowds", Jpda, "crowds_are_shared", {"associate": crowded}, {}),
    ("a lone track's scores halved", Jpda, "one_track_is_a_softmax",
     {"associate": lambda s, a, e: Jpda.associate(s, 0.5 * a if a.shape[-2] == 1 else a, e)}, {}),
]  # fmt: skip


def bent(change):
    return {"evaluate": lambda s, b, z, d, g: change(EKF.evaluate(s, b, z, d, g), z)}


class Elsewhere:
    """A sensor with its noise at the origin."""

    def __init__(self, of):
        self.of = of

    def __getattr__(self, name):
        return getattr(self.of, name)

    def noise(self, x):
        return self.of.noise(0 * x)


def spread_twice(self, belief, dt, rng):
    """The noise of x on every axis but x: seen only of a belief of unlike axes."""
    after = EKF.predict(self, belief, dt, rng)
    return after if dt == 0 else Gaussian(after.mean, after.cov * np.where(np.eye(4), 1.0, 0.9))


ESTIMATORS = [
    ("noise of another place", EKF, "an_unlike_sensor_is_linearised",
     {"evaluate": lambda s, b, z, d, g: EKF.evaluate(s, b, Elsewhere(z), d, g)}, LINEAR),
    ("a volume of one axis less", EKF, "innovations_are_a_gaussians",
     bent(lambda i, z: evolve(i, log_volume=0.5 * i.log_volume)), LINEAR),
    ("correlations fade", EKF, "predicts_as_its_motion_linearised", {"predict": spread_twice}, LINEAR),
    ("the distance of the first mode", Imm, "modes_share_their_innovations",
     {"evaluate": lambda s, b, z, d, g: evolve(i := Imm.evaluate(s, b, z, d, g), distance=2.0 * i.distance)}, TWO),
    ("modes do not mix", Imm, "switching_moves_nothing",
     {"predict": lambda s, b, dt, rng: b if dt == 0 else evolve(
         Imm.predict(s, b, dt, rng), beliefs=tuple(m.predict(x, dt, rng) for m, x in zip(s.modes, b.beliefs, strict=True)))},
     TWO),
    ("the same numbers again", BootstrapParticles, "noise_of_steps_adds_up",
     {"predict": lambda s, b, dt, rng: BootstrapParticles.predict(s, b, dt, np.random.default_rng(1))}, LINEAR),
    ("numbers taken and not used", BootstrapParticles, "draws_from_its_generator",
     {"predict": lambda s, b, dt, rng: BootstrapParticles.predict(s, b, dt, np.random.default_rng(0 * rng.integers(9)))},
     LINEAR),
    ("smooths over half of the time", Kalman, "smooths_as_joint_conditioning",
     {"cross_covariance": lambda s, b, dt: Kalman.cross_covariance(s, b, 0.5 * dt)}, LINEAR),
]  # fmt: skip

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


BIRTHS = [
    ("a return's own noise ignored", FromReturns, "a_sharper_return_starts_a_surer_track",
     {"begin": lambda s, f, e, o, n, d, c: FromReturns.begin(s, f, e, o, n, evolve(d, noise=None), c)}, SPREAD),
    ("bearings start nothing, silently", FromReturns, "refuses_what_starts_no_track", {"begin": blind}, SPREAD),
    ("spread taken for a variance", FromReturns, "spread_as_stated",
     begun(FromReturns, lambda made, s: evolve(made, prior=Gaussian(made.prior.mean, changed(made.prior.cov, lambda P: (
         P.__setitem__((..., 2, 2), 5.0)))))), SPREAD),
    ("surer than stated", FromReturns, "exists_as_stated",
     begun(FromReturns, lambda made, s: evolve(made, existence=0.5 + 0.5 * made.existence)),
     SPREAD | {"initial": st.just(0.2)}),
    ("starts from any sensor", FromReturns, "starts_from_its_sensors", {"starts_from": lambda s, name: True},
     SPREAD | {"sensors": st.just(("radar",))}),
    ("a look thins nothing", Uniform, "a_look_thins_the_unseen", {"update": lambda s, m, e, o, d, c, g: m}, BOX),
    ("comes once a scan", Uniform, "the_unseen_come_and_go_with_time",
     {"predict": lambda s, m, e, dt, rng: np.asarray(m + s.rate)}, BOX),
    ("the unseen never leave", Poisson, "the_unseen_fade",
     {"predict": lambda s, m, e, dt, rng: Poisson.predict(Poisson(s.appear, lifetime=1e9), m, e, dt, rng)}, HERE),
    ("the unseen stand still", Poisson, "the_unseen_move",
     {"predict": lambda s, m, e, dt, rng: Intensity(m.weights * np.exp(-dt / s.lifetime), m.belief)}, HERE),
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
    ("not confirmed while out of sight", MOfN, "a_look_at_nothing_keeps_the_verdict",
     reviewed(MOfN, lambda a, r: (a[0], a[1] & (r.p_detect > 0), a[2])), FEW),
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
    ("the first hit not counted", MOfN, "confirms_after_hits",
     {"start": lambda s, e: (lambda m: evolve(m, own=evolve(m.own, hits=0 * m.own.hits)))(MOfN.start(s, e))}, FEW),
    ("the fall counted from 0", Score, "falls_by_its_drop",
     reviewed(Score, lambda a, r: (evolve(a[0], own=evolve(a[0].own, best=0 * a[0].own.best)), a[1], a[2])),
     {"drop": st.just(5.0)}),
    ("fades in half of its lifetime", Existence, "survives_its_lifetime",
     {"predict": lambda s, e, dt: Existence.predict(s, e, 2 * dt)}, {}),
]  # fmt: skip


def remade(change):
    return {"process": lambda s, scans: change(UC.process(s, scans))}


PREPROCESSORS = [
    ("x and y exchanged", UC, "returns_lie_where_they_were_seen", remade(lambda d: evolve(d, z=d.z[..., ::-1])), {}),
    ("returns' own noise ignored", UC, "sharper_returns_make_sharper_ones",
     {"process": lambda s, scans: UC.process(s, {n: evolve(x, detections=evolve(x.detections, noise=None))
                                                 for n, x in scans.items()})}, {}),
    ("the platform forgotten", UC, "placed_scans_are_placed",
     {"process": lambda s, scans: UC.process(s, {n: evolve(x, pose=None) for n, x in scans.items()})}, {}),
]  # fmt: skip


def opened(change):
    def open(self, sensors, rng):  # noqa: A001  # the role's own name
        recording = Simulation.open(self, sensors, rng)
        return Recording(tuple(change(recording.scans)), recording.truth)

    return {"open": open}


def moved(scan):
    return evolve(scan, detections=Detections(scan.detections.z + 500.0, scan.detections.valid))


LONG = SCENE | {"duration": st.just(30.0)}
SOURCES = [
    ("one seed for all", Simulation, "every_generator_its_own",
     {"open": lambda s, sensors, rng: Simulation.open(s, sensors, np.random.default_rng(1))}, SCENE),
    ("times in ms", Simulation, "scans_last_as_stated",
     opened(lambda scans: [evolve(scan, time=1000 * scan.time) for scan in scans]), SCENE),
    ("each scan twice", Simulation, "scans_come_once",
     opened(lambda scans: [scan for scan in scans for _ in range(2)]), SCENE),
    ("returns lie elsewhere", Simulation, "returns_are_of_the_truth", opened(lambda scans: [moved(s) for s in scans]), LONG),
]  # fmt: skip

PROMISES = [
    *MOTION, *SENSORS, *ASSOCIATORS, *ESTIMATORS, *BIRTHS, *LIFECYCLES, *PREPROCESSORS, *SOURCES,
]  # fmt: skip
