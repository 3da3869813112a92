"""Components of the four roles that break what their parameters' names promise, or what only a longer look shows."""

from __future__ import annotations

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

import vedette
from support.mutants.mixtures import TWO
from support.mutants.parts import put
from vedette import Frame, Gaussian
from vedette.filters import embedded, evaluate_each, prepare
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm, Modes
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.product import Product
from vedette_standard.motion.random_walk import RandomWalk
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate
from vedette_standard.sensors.view import Sector

RB, CP, CV, EKF = RangeBearing, CartesianPosition, ConstantVelocity, ExtendedKalman
LINEAR = {"motion": st.just(CV(0.5))}

APART = {"models": st.just((CV(0.5), RandomWalk(axes=("b",), sigma=1.0)))}
MOTION = [
    ("velocity in km/h", CV, "velocities_move_their_positions",
     {"move": lambda s, x, dt: CV.move(s, x * [1, 1, 1 / 3.6, 1 / 3.6], dt) * [1, 1, 3.6, 3.6],
      "jacobian": lambda s, x, dt: CV.jacobian(s, x, dt) * np.where(np.eye(4, k=2), 1 / 3.6, 1.0)}, {}),
    ("the first model for all", Product, "parts_keep_their_own",
     {"noise": lambda s, x, dt: put(Product.noise(s, x, dt), 4, 4, Product.noise(s, x, dt)[..., 2, 2])}, APART),
]  # fmt: skip


def sees_what_lacks(self, belief, sensor, observed, p_gate):
    """An innovation whose H has the rows of missing components too."""
    where = self.state.locate(sensor.observes)
    x = belief.mean[..., where]
    ready = evolve(prepare(sensor, observed, sensor.measure(x), sensor.noise(x)), present=None)
    H = embedded(sensor.jacobian(x), where, len(self.state))
    return evaluate_each(belief, ready, H[..., None, :, :], x, p_gate)


def not_there(sensor, x):
    return np.where(x[..., :1] > 0, RB.measure(sensor, x), np.nan)


def not_over_it(sensor, x):
    with np.errstate(invalid="ignore"):
        return RB.jacobian(sensor, x) * (x[..., :1] / x[..., :1])[..., None]


def at(change):
    """A platform's pose, changed on the way in."""
    return {"at": lambda s, pose: type(s).__mro__[1].at(s, change(pose))}


SPREAD_OUT = {"clutter_per_scan": st.just(5.0), "max_range": st.just(3000.0), "clutter_density": st.just(0.0)}
SECTORS = {"sectors": st.just((Sector(-1.0, 0.5),)), "polygons": st.just(())}
RANGED = {"max_range": st.just(900.0), "min_range": st.just(0.0)}


def spot(change):
    """Information, score and ratio of a camera, changed."""
    return {"information": lambda s, x, frame, at: change(*GaussianSpot.information(s, x, frame, at))}


SENSORS = [
    ("no bearing behind", RB, "gives_finite_numbers", {"measure": not_there}, {}),
    ("no derivative right over it", RB, "gives_finite_numbers", {"jacobian": not_over_it}, {}),
    ("x counts to the left", CP, "names_mean_the_same",
     {"measure": lambda s, x: x * [-1, 1], "jacobian": lambda s, x: np.diag([-1.0, 1.0])}, {}),
    ("missing components count as expected", EKF, "missing_components_say_nothing", {"evaluate": sees_what_lacks}, {}),
    ("a rate that falls as the range grows", RangeBearingRate, "rates_are_derivatives",
     {"measure": lambda s, x: RangeBearingRate.measure(s, x) * [1, 1, -1],
      "jacobian": lambda s, x: RangeBearingRate.jacobian(s, x) * [[1], [1], [-1]]}, {}),
    ("inverse with the noise of two returns", RB, "a_sharp_return_inverts_exactly",
     {"invert": lambda s, z, noise=None: (lambda g: Gaussian(g.mean, 2 * g.cov))(RB.invert(s, z, noise))},
     {"sigma_bearing": st.floats(1e-4, 0.05)}),
    ("inverse of fixed noise", RB, "the_usual_noise_is_the_sensors",
     {"invert": lambda s, z, noise=None: RB.invert(s, z, 4 * s.noise(np.zeros(2)) if noise is None else noise)}, {}),
    ("the platform's heading ignored", RB, "sees_from_where_it_stands",
     at(lambda pose: evolve(pose, heading=0.0 * pose.heading)), {}),
    ("the platform's place ignored", RB, "sees_from_where_it_stands",
     at(lambda pose: evolve(pose, position=0.0 * pose.position)), {}),
    ("deviations for their squares", RB, "deviations_count",
     {"noise": lambda s, x: np.diag([s.sigma_range**2, s.sigma_bearing])}, {"sigma_extent": st.just(0.0)}),
    ("covers a circle around the origin", RB, "sees_from_where_it_stands",
     {"detects": lambda s, x: np.where(np.hypot(x[..., 0], x[..., 1]) < s.max_range, 0.9, 0.0)}, RANGED),
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
    ("sees beside its sectors", RB, "detects_within_its_sectors",
     {"_share": lambda s, spot: np.ones(spot.shape[:-1])}, SECTORS),
    ("its sectors turn the wrong way", CP, "detects_within_its_sectors",
     {"_share": lambda s, spot: RB._share(s, spot * [1, -1])}, SECTORS),
    ("false returns beside its sectors", RB, "detects_within_its_sectors",
     {"covers": lambda s, z: np.ones((), dtype=bool)}, SECTORS),
    ("false returns in half of its view", BearingOnly, "sees_nothing_where_it_covers_nothing",
     {"covers": lambda s, z: z[..., 0] > 0}, {}),
    ("as many false returns in its sectors as all around", RB, "false_returns_add_up",
     {"clutter": lambda s, z: RB.clutter(evolve(s, sectors=()), z)}, SECTORS | SPREAD_OUT),
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


def least_of_names(self, scores, evidence):
    """What is far likelier than a miss is not taken."""
    return GlobalNearest.associate(self, np.where(scores > 3.0, scores - 20.0, scores), evidence)


def counted_twice(self, belief, innovation, weights):
    return BootstrapParticles.update(self, BootstrapParticles.update(self, belief, innovation, weights), innovation, weights)


ASSOCIATORS = [
    ("ties are taken by all", GlobalNearest, "settles_ties", {"associate": argmax_twice}, {}),
    ("half of it without evidence", Pda, "needs_no_evidence", {"associate": shared_without_evidence}, {}),
    ("ratios to the miss", Pda, "rows_sum_to_one", {"associate": certain_misses}, {}),
    ("each by itself in crowds", Jpda, "crowds_are_shared", {"associate": crowded}, {}),
    ("a lone track's scores halved", Jpda, "one_track_is_a_softmax",
     {"associate": lambda s, a, e: Jpda.associate(s, 0.5 * a if a.shape[-2] == 1 else a, e)}, {}),
    ("what is likeliest is taken least", GlobalNearest, "names_tell_pairs_apart", {"associate": least_of_names}, {}),
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

    def mean_noise(self, x, cov):
        return self.of.mean_noise(0 * x, cov)


def spread_twice(self, belief, dt, rng):
    """The noise of x on every axis but x: seen only of a belief of unlike axes."""
    after = EKF.predict(self, belief, dt, rng)
    return after if dt == 0 else Gaussian(after.mean, after.cov * np.where(np.eye(4), 1.0, 0.9))


def drawn_once(self, belief, dt, rng):
    """Moved points, with the noise of one track for every track and every run."""
    if dt == 0:
        return belief
    root = vedette.kernels.root(self.motion.noise(belief.points, dt))
    noise = root @ rng.standard_normal((*belief.points.shape[-2:], 1))
    return evolve(belief, points=self.state.displace(self.motion.move(belief.points, dt), noise[..., 0]))


def as_if_new(belief):
    return Modes(belief.beliefs, 0.0 * belief.log_prob - np.log(2))


def framed(evaluate):
    """With another evaluation of frames."""
    return {"evaluate": lambda s, b, z, d, g: (evaluate if isinstance(d, Frame) else EKF.evaluate)(s, b, z, d, g)}


ESTIMATORS = [
    ("noise of another place", EKF, "an_unlike_sensor_is_linearised",
     {"evaluate": lambda s, b, z, d, g: EKF.evaluate(s, b, Elsewhere(z), d, g)}, LINEAR),
    ("a volume of one axis less", EKF, "a_unit_of_measurement_is_free",
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
    ("each return counts twice", BootstrapParticles, "a_return_counts_once", {"update": counted_twice}, LINEAR),
    ("numbers taken and not used", BootstrapParticles, "draws_from_its_generator",
     {"predict": lambda s, b, dt, rng: BootstrapParticles.predict(s, b, dt, np.random.default_rng(0 * rng.integers(9)))},
     LINEAR),
    ("one track's numbers for all", BootstrapParticles, "tracks_draw_their_own", {"predict": drawn_once}, LINEAR),
    ("noise of 1 more, in whatever unit", EKF, "a_unit_of_measurement_is_free",
     {"evaluate": lambda s, b, z, d, g: EKF.evaluate(s, b, evolve(z, R=z.R + np.eye(len(z.R))), d, g)}, LINEAR),
    ("all tracks take what one takes", BootstrapParticles, "tracks_come_and_go",
     {"update": lambda s, b, i, w: BootstrapParticles.update(s, b, i, np.broadcast_to(w.mean(1, keepdims=True), w.shape))},
     LINEAR),
    ("a frame read upside down", EKF, "frames_show_the_target",
     framed(lambda s, b, z, d, g: EKF.evaluate(s, b, z, evolve(d, pixels=d.pixels[..., ::-1, :]), g)), LINEAR),
    ("a frame speaks against what it shows", EKF, "frames_are_compared_with_the_first",
     framed(lambda s, b, z, d, g: evolve(i := EKF.evaluate(s, b, z, d, g), loglik=i.loglik * np.array([1, -1]))), LINEAR),
    ("scans before the last forgotten", Imm, "modes_remember_every_scan",
     {"evaluate": lambda s, b, z, d, g: Imm.evaluate(s, as_if_new(b), z, d, g),
      "update": lambda s, b, i, w: Imm.update(s, as_if_new(b), i, w)}, TWO),
    ("smooths over half of the time", Kalman, "smooths_as_joint_conditioning",
     {"cross_covariance": lambda s, b, dt: Kalman.cross_covariance(s, b, 0.5 * dt)}, LINEAR),
]  # fmt: skip

PROMISES = [*MOTION, *SENSORS, *ASSOCIATORS, *ESTIMATORS]
