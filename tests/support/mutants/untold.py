"""Components with one thing wrong, of kinds that an outsider planted and no law told."""

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from support.mutants.associators import softmax
from vedette import Detections, Space, kernels
from vedette.testing.strategies import SENSOR
from vedette_boxes.motion.box_velocity import BoxVelocity
from vedette_boxes.sensors.box import Box
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.preprocessors.grouped_returns import GroupedReturns
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

CV, CT, CP, RB, BP = ConstantVelocity, CoordinatedTurn, CartesianPosition, RangeBearing, BootstrapParticles
LINEAR = {"motion": st.just(CV(0.5))}
OVER_RANGES = {
    "clutter_per_scan": st.just(5.0), "max_range": st.just(3000.0), "min_range": st.just(0.0), "sectors": st.just(()),
    "clutter_density": st.just(0.0), "clutter_uniform_over": st.just("range"), "polygons": st.just(()),
}  # fmt: skip
ALONE = {"sensors": st.just({SENSOR: CP(5.0)}), "link": st.just(0.1), "fewest": st.just(1)}


def without_own_noise(base):
    """An estimator to which returns bring none."""
    return {
        "evaluate": lambda s, b, z, d, g: base.evaluate(
            s, b, z, evolve(d, noise=None) if isinstance(d, Detections) else d, g
        )
    }


def started_alike(self, prior, axes, rng):
    """The first track's points for all: right for tracks that start alike, but for what they share."""
    belief = BP.start(self, prior, axes, rng)
    return evolve(belief, points=np.broadcast_to(belief.points[:1, :1], belief.points.shape))


def noise_of_one(self, belief, dt, rng):
    """Each track's points with the noise of its first."""
    if dt == 0:
        return belief
    root = kernels.root(np.broadcast_to(self.motion.noise(belief.points[..., :1, :], dt), (*belief.points.shape, 1)))
    noise = (root @ rng.standard_normal((*belief.points.shape, 1)))[..., 0]
    return evolve(belief, points=self.state.displace(self.motion.move(belief.points, dt), noise))


def detected_as_one(self, belief, sensor, seen, p_gate):
    """Each track detected as its first point is."""
    innovation = BP.evaluate(self, belief, sensor, seen, p_gate)
    p = np.asarray(sensor.detects(belief.points[..., 0, self.state.locate(sensor.observes)]))[..., None]
    missed = np.log(1 - p * p_gate)
    return evolve(innovation, loglik=np.concatenate([missed, innovation.loglik[..., 1:]], axis=-1))


def counted_twice(self, scores, evidence):
    return softmax(scores if evidence is None else scores + np.concatenate([0 * scores[..., :1, :1], evidence], axis=-1))


def made(base, **changes):
    """What a preprocessor makes, with parts changed."""

    def process(self, scans):
        found = base.process(self, scans)
        return evolve(found, **{name: change(getattr(found, name)) for name, change in changes.items()})

    return {"process": process}


def quartered(noise):
    return None if noise is None else noise / 4


UNTOLD = [
    ("moves for a minute at most", CV, "any_gap_can_be_moved_over",
     {"move": lambda s, x, dt: CV.move(s, x, min(dt, 60.0))}, {}),
    ("the noise at the mean, for its mean", BoxVelocity, "mean_noise_is_a_mean",
     {"mean_noise": lambda s, x, cov, dt: BoxVelocity.noise(s, x, dt)}, {}),
    ("the noise of the box at the mean, for its mean", Box, "mean_noise_is_a_mean",
     {"mean_noise": lambda s, x, cov: Box.noise(s, x)}, {}),
    ("a velocity's noise beside its position's", CV, "an_integrals_noise_goes_with_it",
     {"noise": lambda s, x, dt: CV.noise(s, x, dt) * np.eye(4), "divisible": False}, {}),
    ("deviations of one another", CT, "noise_has_its_units",
     {"noise": lambda s, x, dt: CT.noise(CT(s.sigma_turn_rate, s.sigma_accel), x, dt)}, {}),
    ("a turn rate called one in degrees", CT, "turn_rates_turn",
     {"state": Space.of(x="m", y="m", vx="m/s", vy="m/s", turn_rate="deg/s"), "twin": None}, {}),
    ("a deviation taken for degrees", BearingOnly, "deviations_count",
     {"noise": lambda s, x: np.radians(s.sigma_bearing) ** 2 * np.eye(1)}, {}),
    ("a detection probability of its own", CP, "detection_is_a_probability", {"detects": lambda s, x: np.asarray(0.9)}, {}),
    ("ranges that end at 20 km", RB, "jacobian_is_the_derivative",
     {"measure": lambda s, x: np.minimum(RB.measure(s, x), [2e4, np.inf])}, {}),
    ("clutter over a metre", RB, "clutter_spreads_over_what_may_lack", {"optional": {"range": 1.0}}, OVER_RANGES),
    ("an axis that is none", RB, "clutter_spreads_over_what_may_lack", {"optional": {"rang": 3000.0}}, OVER_RANGES),
    ("names of other returns", UnbiasedConversion, "what_is_said_of_a_return_goes_with_it",
     made(UnbiasedConversion, identity=lambda codes: None if codes is None else codes[..., ::-1]), {}),
    ("sharper than it was seen", GroupedReturns, "what_is_said_of_a_return_goes_with_it",
     made(GroupedReturns, noise=quartered), ALONE),
    ("evidence counted twice", Pda, "needs_no_evidence",
     {"associate": counted_twice}, {}),
    ("a return's own noise ignored", Kalman, "an_unlike_sensor_is_linearised", without_own_noise(Kalman), LINEAR),
    ("own noise ignored by points", BP, "an_unlike_sensor_is_linearised", without_own_noise(BP), LINEAR),
    ("one start for all", BP, "tracks_draw_their_own", {"start": started_alike}, LINEAR),
    ("one point's noise for all", BP, "all_of_a_belief_counts", {"predict": noise_of_one}, LINEAR),
    ("one point's detection for all", BP, "all_of_a_belief_counts", {"evaluate": detected_as_one}, LINEAR),
]  # fmt: skip
