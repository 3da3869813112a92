"""Components that break what they declare, in shapes that no catalogue has: cameras of any axes, other sensors, ties."""

import numpy as np
from attrs import evolve, frozen
from hypothesis import strategies as st

from support.mutants.parts import CALLS
from support.mutants.sources import BOAT, SCENE
from vedette import Associator, Detections, Gaussian, MotionModel, Space, fields
from vedette.testing.strategies import SENSOR
from vedette.types import Frame, Recording, Scan, Trajectory
from vedette.values import held
from vedette_flir.camera import Camera
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_marine.preprocessors.cfar import Cfar
from vedette_marine.screen import RadarScreen
from vedette_sim import Simulation
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.given import Given
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.coast_limited import CoastLimited
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.particles import normalised
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_vts.decorrelated_position import DecorrelatedPosition

SPOT, BOX, RB, CP, RBE = GaussianSpot, BoxCentroid, RangeBearing, CartesianPosition, RangeBearingElevation
BP, CV = BootstrapParticles, ConstantVelocity
EYE = {"camera": st.just(Camera(sigma=3.0, window=10))}
LEARNS = EYE | {"gain_amplitude": st.just(0.5)}
LINEAR = {"motion": st.just(CV(0.5))}
TWO = SCENE | {"drawn": st.just({"boat": BOAT, "ship": BOAT}), "duration": st.just(20.0)}
SPOTS = {
    "targets": st.just({"spot": HotTarget(ImageVelocity(20.0), (HotSpot(10.0, 2.0),), start={
        "x": (30.0, 1.0), "y": (40.0, 1.0), "vx": (0.0, 1.0), "vy": (0.0, 1.0)})}),
    "width": st.just(64), "height": st.just(64), "frames": st.just(4), "corner": st.just((0.0, 0.0)),
}  # fmt: skip


def told(base, change):
    """An `information` with J, g and llr changed."""
    return {"information": lambda s, x, frame, at: change(*base.information(s, x, frame, at))}


def seen(base, change):
    """An `information` of another frame."""
    return {"information": lambda s, x, frame, at: base.information(s, x, change(frame), at)}


def shifted(frame):
    corner = np.zeros(2) if frame.corner is None else frame.corner
    return Frame(frame.pixels, corner + 0.5)


def without_level(self, x, frame, at):
    x, at = (np.concatenate([each[..., :-1], 0.0 * each[..., -1:]], axis=-1) for each in (x, at))
    return SPOT.information(self, x, frame, at)


def brighter_and_brighter(self, x, frame):
    learnt = np.array(x)
    learnt[..., self.observes.names.index("amplitude")] *= 1.5
    return learnt


def forgets(self, belief, dt, rng):
    """What was learnt is forgotten one step later: all points weigh the same again."""
    return BP.predict(self, evolve(belief, log_weights=np.full_like(belief.log_weights, -np.log(self.particles))), dt, rng)


def weighs_twice(self, belief, dt, rng):
    """Points are resampled by their weights, and keep them."""
    return BP.predict(self, evolve(belief, log_weights=normalised(2 * belief.log_weights)) if dt else belief, dt, rng)


def keeps_places(self, belief, dt, rng):
    """Points are resampled by their weights, which stay where they were."""
    return evolve(BP.predict(self, belief, dt, rng), log_weights=belief.log_weights)


def decides(self, belief, innovation, weights):
    best = np.argmax(weights, axis=-1)[..., None] == np.arange(weights.shape[-1])
    return BP.update(self, belief, innovation, best.astype(float))


def one_by_one(self, z, noise=None):
    rows = None if noise is None else noise.reshape(-1, 2, 2)
    return RB.invert(self, z.reshape(-1, 2), rows)


@frozen
class Sails(MotionModel):
    """A vessel that goes where it heads, clockwise from north, at its speed."""

    kind = "kit_sails"
    sigma: float = fields.quantity("m/s^1.5", "noise of the speed", above=0)
    state = property(lambda self: Space.of(x="m", y="m", heading="rad mod 2pi", speed="m/s"))

    def move(self, x, dt):
        step = dt * x[..., 3]
        return np.stack(
            [x[..., 0] + step * np.sin(x[..., 2]), x[..., 1] + step * np.cos(x[..., 2]), x[..., 2], x[..., 3]], -1
        )

    def noise(self, x, dt):
        return np.diag([0.0, 0.0, 0.0, self.sigma**2 * dt])


def reversed_turn(self, x, dt):
    return Sails.move(self, x * [1.0, 1.0, 2.0, 1.0], dt) * [1.0, 1.0, 0.5, 1.0]


def first_thirty(self, scores, evidence):
    weights = np.array(Pda.associate(self, scores, evidence))
    weights[..., 31:] = 0.0
    return weights / weights.sum(axis=-1, keepdims=True)


@frozen
class Leading(Associator):
    """Takes the best return; of equal ones the first."""

    kind = "kit_leading"

    def associate(self, scores, evidence):
        return (np.argmax(scores, axis=-1)[..., None] == np.arange(scores.shape[-1])).astype(float)


def tossed(self, scores, evidence):
    """Of equal ones any."""
    shaken = scores + 1e-9 * np.random.default_rng(next(CALLS)).random(scores.shape)
    return Leading.associate(self, shaken, evidence)


def keeps_in_place(self, hypotheses, alive):
    array = next(part for part in held(hypotheses) if isinstance(part, np.ndarray) and part.size)
    array[...] = array
    return KBest.keep(self, hypotheses, alive)


def begun(change):
    def begin(self, found, estimator, sensor, name, detections, claimed):
        made = FromReturns.begin(self, found, estimator, sensor, name, detections, claimed)
        return change(made, claimed)

    return {"begin": begin}


def impatient(self, memory, scan):
    memory, confirmed, alive = Existence.review(self, memory, scan)
    return memory, confirmed, alive & (scan.existence > 2 * self.least_existence)


def forgives(self, own, scan):
    own, confirmed, alive = CoastLimited.judge(self, own, scan)
    return evolve(own, missed=np.minimum(own.missed, 0.5)), confirmed, np.ones_like(alive)


def opened(change):
    """A source whose recording is changed on the way out."""
    return {"open": lambda self, sensors, rng: change(Simulation.open(self, sensors, rng), sensors, rng)}


def rewritten(recording, change):
    scans = [Scan(s.time, s.sensor, Detections.of(change(s), s.detections.z.shape[-1]), s.pose) for s in recording.scans]
    return Recording(tuple(scans), recording.truth)


def late(recording, sensors, rng):
    """The truth says that targets came later than they were seen."""
    return Recording(recording.scans, tuple(Trajectory(t.name, t.space, t.times[3:], t.states[3:]) for t in recording.truth))


def unwrapped(recording, sensors, rng):
    angles = [axis.period or 0.0 for axis in sensors[SENSOR].measurement.axes]
    return rewritten(recording, lambda scan: scan.detections.z + np.array(angles))


def roundabout(recording, sensors, rng):
    """The truth leaves its path in the middle, and comes back to it."""
    paths = []
    for path in recording.truth:
        way = np.sin(np.pi * (path.times - path.times[0]) / np.ptp(path.times))
        along = np.isin(path.space.names, ["x", "y"]) * np.ptp(path.states, axis=0)
        paths.append(evolve(path, states=path.states + 0.4 * way[:, None] * along))
    return evolve(recording, truth=tuple(paths))


def backward(recording, sensors, rng):
    def turned(path):
        signs = [-1.0 if name.startswith("v") else 1.0 for name in path.space.names]
        return Trajectory(path.name, path.space, path.times, path.states * signs)

    return Recording(recording.scans, tuple(map(turned, recording.truth)))


def states(recording, time):
    return np.array([state for path in recording.truth if (state := path.at(time)) is not None]).reshape(-1, 4)


def always(recording, sensors, rng):
    sensor = sensors[SENSOR]
    return rewritten(recording, lambda scan: sensor.measure(states(recording, scan.time)[:, : len(sensor.observes)]))


def in_order(recording, sensors, rng):
    def sorted_returns(scan):
        z, truth = scan.detections.z, states(recording, scan.time)
        return z[np.argsort(np.sum((z - truth[0, :2]) ** 2, axis=-1))] if len(truth) else z

    return rewritten(recording, sorted_returns)


def mirrored(self, sensors, rng):
    recording = InfraredScene.open(self, sensors, rng)
    turned = [evolve(s, frame=Frame(np.swapaxes(s.frame.pixels, -1, -2), s.frame.corner)) for s in recording.scans]
    return Recording(tuple(turned), recording.truth)


DECLARED = [
    ("a score away from the target", BOX, "pictures_inform", told(BOX, lambda J, g, llr: (J, -g, llr)), {}),
    ("dead pixels as dark ones", BOX, "pictures_inform", told(BOX, lambda J, g, llr: (J + 1e-3 * np.eye(2), g, llr)), {}),
    ("half a pixel", SPOT, "a_step_leads_to_the_target", seen(SPOT, shifted), EYE),
    ("half a pixel, in a box", BOX, "a_step_leads_to_the_target", seen(BOX, shifted), {}),
    ("rows for columns", SPOT, "pictures_show_where",
     seen(SPOT, lambda f: Frame(np.swapaxes(f.pixels, -1, -2), f.corner)), EYE),
    ("a corner that is forgotten", BOX, "pictures_show_where", seen(BOX, lambda f: Frame(f.pixels)), {}),
    ("J by sigma", SPOT, "frames_inform_as_stated", told(SPOT, lambda J, g, llr: (3.0 * J, g, llr)), EYE),
    ("a third of J, declared conservative", SPOT, "frames_inform_as_stated",
     {"conservative": True} | told(SPOT, lambda J, g, llr: (J / 3, g, llr)), EYE),
    ("a quarter of the noise", SPOT, "noise_is_what_a_frame_leaves",
     {"noise": lambda s, x: SPOT.noise(s, x) / 4}, EYE),
    ("a ratio that noise has, too", BOX, "noise_speaks_for_no_target", told(BOX, lambda J, g, llr: (J, g, llr + 16.0)), {}),
    ("the background kept", SPOT, "a_known_level_changes_nothing", {"information": without_level}, EYE),
    ("learns that it is brighter", SPOT, "learning_leaves_the_place", {"learn": brighter_and_brighter}, LEARNS),
    ("a return forgotten", BP, "a_return_counts_once", {"predict": forgets}, LINEAR),
    ("weights at their old places", BP, "a_return_counts_once", {"predict": keeps_places},
     LINEAR | {"resample": st.just(1.0)}),
    ("weights after resampling", BP, "a_return_counts_once", {"predict": weighs_twice},
     LINEAR | {"resample": st.just(1.0)}),
    ("a box of half the gate", Kalman, "gates_lie_in_their_extent",
     {"extent": lambda s, b, sensor, seen, limit: Kalman.extent(s, b, sensor, seen, limit / 4)}, LINEAR),
    ("placed where it stands", DecorrelatedPosition, "standing_elsewhere_keeps_the_axes",
     {"at": lambda s, pose: object.__setattr__(s, "_pose", pose) or s}, {}),
    ("one return for certain", BP, "soft_weights_mix_what_is_drawn", {"update": decides}, LINEAR),
    ("forgets with each step", Kalman, "a_short_time_forgets_nothing",
     {"predict": lambda s, b, dt, rng: Gaussian((p := Kalman.predict(s, b, dt, rng)).mean, 1.02 * p.cov) if dt else b},
     LINEAR),
    ("modes mixed at once", Imm, "no_time_changes_nothing",
     {"predict": lambda s, b, dt, rng: Imm.predict(s, b, max(dt, 1e-12), rng)}, {}),
    ("returns in a row", RB, "inverts_in_batches", {"invert": one_by_one}, {}),
    ("R over the other axes", RB, "deviations_count",
     {"noise": lambda s, x: np.diag([s.sigma_bearing**2, s.sigma_range**2])}, {}),
    ("a range in the plane", RBE, "detects_within_max_range",
     {"detects": lambda s, x: s.detection_probability * (np.hypot(x[..., 0] - s.x, x[..., 1] - s.y) <= s.max_range)},
     {"max_range": st.just(5000.0)}),
    ("a sum for each axis", CP, "names_mean_the_same", {"jacobian": lambda s, x: np.ones((2, 2))}, {}),
    ("turns by half", Sails, "headings_lead_the_way", {"move": reversed_turn}, {}),
    ("twice the way", Sails, "headings_lead_the_way",
     {"move": lambda s, x, dt: Sails.move(s, x, 2 * dt)}, {}),
    ("the thirty-first return", Pda, "every_return_counts", {"associate": first_thirty}, {}),
    ("ties by chance", Leading, "settles_ties", {"associate": tossed}, {}),
    ("keeps in place", KBest, "keeping_all_changes_nothing", {"keep": keeps_in_place}, {}),
    ("surer the more it is claimed", FromReturns, "claimed_returns_start_nothing",
     begun(lambda made, claimed: evolve(made, existence=0.1 + 0.8 * claimed[made.returns])),
     {"spread": st.just({"vx": 5.0, "vy": 5.0})}),
    ("an offset that is forgotten", Given, "given_tracks_start_as_stated",
     {"given": lambda s, state, recording: Given.given(evolve(s, offset={}), state, recording)},
     {"start": st.just({}), "spread": st.just(dict.fromkeys(("x", "y", "vx", "vy"), 2.0)), "offset": st.just({"x": 9.0})}),
    ("no sensors means none", FromReturns, "starts_from_its_sensors",
     {"starts_from": lambda s, name: name in s.sensors},
     {"sensors": st.just(()), "spread": st.just({"vx": 5.0, "vy": 5.0})}),
    ("ends above its least existence", Existence, "ends_below_its_least_existence", {"review": impatient}, {}),
    ("misses that do not add up", CoastLimited, "unseen_tracks_end", {"judge": forgives},
     {"max_without_detection": st.none()}),
    ("a score without information", RadarScreen, "pictures_inform", {"information": lambda s, x, frame, at: (
        (told := RadarScreen.information(s, x, frame, at))[0], told[1] + 1.0, told[2])}, {}),
    ("evidence that is dropped", UnbiasedConversion, "what_is_said_of_a_return_goes_with_it",
     {"process": lambda s, scans: evolve(UnbiasedConversion.process(s, scans), evidence=None)}, {}),
    ("echoes where the radar is not", Cfar, "pictures_make_returns",
     {"process": lambda s, scans: Cfar.process(s, {name: evolve(scan, pose=None) for name, scan in scans.items()})},
     {"sensors": st.just({"receiver": RadarScreen()}), "window": st.just(16)}),
    ("bearings beyond a turn", Simulation, "scans_are_the_sensors", opened(unwrapped), SCENE),
    ("velocities of the wrong sign", Simulation, "truth_moves_as_its_velocities", opened(backward), TWO),
    ("a detour that velocities do not show", Simulation, "truth_moves_as_its_velocities", opened(roundabout),
     SCENE | {"duration": st.just(60.0)}),
    ("two of one name", Simulation, "truth_is_in_order", opened(lambda recording, *_: (
        evolve(recording, truth=tuple(evolve(path, name="boat") for path in recording.truth)))), TWO),
    ("targets that are always seen", Simulation, "targets_are_missed_as_stated", opened(always), TWO),
    ("returns in the order of targets", Simulation, "targets_are_missed_as_stated", opened(in_order), TWO),
    ("seen before they come", Simulation, "nobody_is_seen_before_or_after", opened(late),
     SCENE | {"duration": st.just(9.0)}),
    ("a variance for a deviation in the background", InfraredScene, "pictures_vary_as_stated",
     {"open": lambda s, sensors, rng: InfraredScene.open(evolve(s, clutter=s.clutter**2), sensors, rng)},
     SPOTS | {"clutter": st.floats(3.0, 8.0)}),
    ("pictures of rows for columns", InfraredScene, "pictures_show_the_truth", {"open": mirrored}, SPOTS),
]  # fmt: skip
