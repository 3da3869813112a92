"""Sources, preprocessors, births and lifecycles that do not do what they declare: scenes, areas, limits, evidence."""

import numpy as np
from attrs import evolve
from hypothesis import strategies as st

from support.mutants.declared import SPOTS
from support.mutants.sources import BOAT
from vedette import Gaussian
from vedette.testing.laws.source import OTHER
from vedette.testing.strategies import SENSOR
from vedette.types import Recording
from vedette_bayes_risk.likelihood import CountLikelihoodDetection
from vedette_flir.lifecycles.reappearing import ReappearingTarget
from vedette_flir.lifecycles.sought import SoughtTarget
from vedette_flir.motion.image_velocity import ImageVelocity
from vedette_marine.preprocessors.cfar import Cfar
from vedette_marine.screen import RadarScreen
from vedette_sim import Look, PpiRadar, RadarPicturesScene, RadarPointsScene, Ship, Simulation, Vessel
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene
from vedette_standard.associators.pda import Pda
from vedette_standard.births.given import Given
from vedette_standard.births.two_point import TwoPoint
from vedette_standard.births.uniform import Uniform
from vedette_standard.lifecycles.coast_limited import CoastLimited
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.preprocessors.naive_conversion import NaiveConversion
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.regions import Polygon
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

SENSORS = {name: CartesianPosition(5.0, 0.9, 1e-5) for name in "abc"}
STILL = dict.fromkeys(("vx", "vy"), (0.0, 1.0))
FUSED = {"sensors": st.just(SENSORS), "base": st.just("a"), "threshold": st.just(30.0)}
RADAR = {"sensors": st.just({SENSOR: RangeBearing(5.0, 0.01, sigma_extent=20.0)})}
HOT = HotTarget(ImageVelocity(20.0), (HotSpot(80.0, 2.0),), start=dict.fromkeys(("x", "y"), (30.0, 1.0)) | STILL)
DRIFTING = SPOTS | {
    "targets": st.just({"spot": HOT}),
    "clutter": st.just(5.0), "clutter_time": st.just(0.2), "drift": st.just((60.0, -30.0)), "rate": st.just(30.0),
    "sigma": st.just(1.0),
}  # fmt: skip
BOATS = RadarPicturesScene(
    radar=PpiRadar(metres_per_pixel=20.0, range=600.0, size=64, azimuths=128, beam=0.06),
    vessels={"boat": Vessel(Ship(start=[-200.0, 300.0], speed=8.0), length=40.0, width=8.0)},
    frames=6,
)
POINTS = {"scene": st.just(BOATS), "extent": st.just(0.02), "sigma": st.just(1.0), "clutter": st.just(3e-5)}
ALONE = dict.fromkeys(("ships", "drawn", "populations", "crossings", "convoys", "sensors"), st.just({}))
LOCKSTEP = ALONE | {
    "duration": st.just(20.0), "looks": st.just({SENSOR: Look(interval=1.0, first=1.5)}), "drawn": st.just({"boat": BOAT}),
}  # fmt: skip
TWO_LOOKS = LOCKSTEP | {"looks": st.just({name: Look(interval=1.0, first=1.5) for name in (SENSOR, OTHER)})}
LEAVES = Ship(start=[100.0, 50.0], speed=8.0, disappears=4.0)
LEFT = LOCKSTEP | {"drawn": st.just({}), "ships": st.just({"ship": LEAVES})}
SCREEN = {"sensors": st.just({"screen": RadarScreen()}), "window": st.just(16)}
AREA = {"survives_in": st.just((Polygon([[-300.0, -250.0], [280.0, -320.0], [350.0, 40.0], [-120.0, 330.0]]),))}


def other(base, method, **changed):
    """What a component does that has other parameters than it says: functions of its own."""

    def made(self, *given):
        return getattr(base, method)(evolve(self, **{name: change(self) for name, change in changed.items()}), *given)

    return {method: made}


def told(base, name, change):
    """A source whose truth says something else of an axis."""

    def open(self, sensors, rng):  # noqa: A001  # the role's own name
        recording = base.open(self, sensors, rng)
        paths = []
        for path in recording.truth:
            states = np.array(path.states)
            states[:, path.space.names.index(name)] = change(states[:, path.space.names.index(name)])
            paths.append(evolve(path, states=path.space.canonical(states)))
        return Recording(recording.scans, tuple(paths))

    return {"open": open}


def late_states(self, sensors, rngs):
    scenes = Simulation.open_together(self, sensors, rngs)
    return scenes and evolve(scenes, states=scenes.states + 500.0)


def sensor_by_sensor(self, sensors, rngs):
    scenes = Simulation.open_together(self, sensors, rngs)
    return evolve(scenes, scans=tuple(sorted(scenes.scans, key=lambda scan: scan.sensor)))


def without_pixels(self, sensors, rng):
    recording = InfraredScene.open(self, sensors, rng)
    first = recording.scans[0]
    dark = evolve(first, frame=evolve(first.frame, pixels=np.full_like(first.frame.pixels, np.nan)))
    return Recording((dark, *recording.scans[1:]), recording.truth)


def around_their_middle(self, scans):
    made = UnbiasedConversion.process(self, scans)
    return evolve(made, z=made.z + 1e-3 * made.z.mean(axis=-2, keepdims=True)) if made.z.shape[-2] else made


def sure_of_velocities(self, found, estimator, sensor, name, detections, claimed):
    made = TwoPoint.begin(self, found, estimator, sensor, name, detections, claimed)
    scale = np.array([0.3 if axis.startswith("v") else 1.0 for axis in estimator.state.names])
    return evolve(made, prior=Gaussian(made.prior.mean, made.prior.cov * scale[:, None] * scale))


def overflowing(self, scores, evidence):
    likely = np.exp(scores)
    return likely / likely.sum(axis=-1, keepdims=True)


DECLARED_SUPPORTING = [
    ("a background that drifts the other way", InfraredScene, "backgrounds_drift_as_stated",
     other(InfraredScene, "open", drift=lambda s: np.multiply(s.drift, -1.0)), DRIFTING),
    ("a background that fades too soon", InfraredScene, "backgrounds_drift_as_stated",
     other(InfraredScene, "open", clutter_time=lambda s: s.clutter_time / 2), DRIFTING),
    ("boxes a third as wide", InfraredScene, "pictures_show_the_truth",
     told(InfraredScene, "width", lambda width: 0.3 * width), DRIFTING | {"clutter": st.just(0.0)}),
    ("points that err more", RadarPointsScene, "scatters_as_stated",
     other(RadarPointsScene, "open", extent=lambda s: 4.0 * s.extent), POINTS),
    ("twice the clutter", RadarPointsScene, "scatters_as_stated",
     other(RadarPointsScene, "open", clutter=lambda s: 2.0 * s.clutter), POINTS),
    ("ten times the false alarms", Cfar, "false_alarms_are_as_rare_as_stated",
     other(Cfar, "process", rate=lambda s: 10.0 * s.rate), SCREEN),
    ("a frame without a pixel", InfraredScene, "scans_are_the_sensors", {"open": without_pixels}, DRIFTING),
    ("sensor by sensor in lock-step", Simulation, "scans_come_in_time_order",
     {"open_together": sensor_by_sensor}, TWO_LOOKS),
    ("confirms half as far", CountLikelihoodDetection, "sensors_confirm_within_the_threshold",
     other(CountLikelihoodDetection, "process", threshold=lambda s: s.threshold / 2), FUSED),
    ("no clutter at all", RadarPointsScene, "scatters_as_stated",
     other(RadarPointsScene, "open", clutter=lambda s: 0.0), POINTS),
    ("drawn in lock-step after it left", Simulation, "drawn_together_as_alone",
     other(Simulation, "open_together", ships=lambda s: {"ship": evolve(LEAVES, disappears=None)}), LEFT),
    ("a ship that comes late", Simulation, "truth_comes_and_goes_as_stated",
     other(Simulation, "open", ships=lambda s: {"ship": evolve(LEAVES, appears=2.0)}), LEFT),
    ("a course from north", Simulation, "truth_comes_and_goes_as_stated",
     other(Simulation, "open", ships=lambda s: {"ship": evolve(LEAVES, course=np.pi / 2)}), LEFT),
    ("spots of half the width", InfraredScene, "targets_are_as_bright_as_stated",
     other(InfraredScene, "open", targets=lambda s: {"spot": evolve(HOT, spots=(HotSpot(80.0, 1.0),))}),
     DRIFTING | {"clutter": st.just(0.0)}),
    ("headings backward", RadarPointsScene, "truth_moves_as_its_velocities",
     told(RadarPointsScene, "heading", lambda heading: heading + np.pi), POINTS),
    ("other states in lock-step", Simulation, "drawn_together_as_alone", {"open_together": late_states}, LOCKSTEP),
    ("returns that pull at each other", UnbiasedConversion, "others_far_away_change_nothing",
     {"process": around_their_middle}, RADAR),
    ("an extent that is forgotten", NaiveConversion, "sharper_returns_make_sharper_ones",
     other(NaiveConversion, "process", sensors=lambda s: {SENSOR: evolve(s.sensors[SENSOR], sigma_extent=0.0)}), RADAR),
    ("evidence for clutter", CountLikelihoodDetection, "evidence_is_a_likelihood_ratio",
     {"log_weights": lambda s: -CountLikelihoodDetection.log_weights(s)}, FUSED),
    ("twice the noise of what it fuses", CountLikelihoodDetection, "errors_are_as_stated", {"process": lambda s, scans: (
        evolve(made := CountLikelihoodDetection.process(s, scans), noise=2.0 * made.noise))}, FUSED),
    ("velocities too sure", TwoPoint, "tracks_are_as_unsure_as_their_returns", {"begin": sure_of_velocities},
     {"max_speed": st.just(50.0), "spread": st.just({})}),
    ("nobody unseen is ever found", Uniform, "tracks_are_as_unsure_as_their_returns",
     other(Uniform, "begin", least=lambda s: 1.0), {"least": st.just(1e-5)}),
    ("faint returns dropped", Uniform, "a_track_of_the_unseen_exists_by_their_density",
     other(Uniform, "begin", least=lambda s: 0.05), {"least": st.just(1e-5)}),
    ("one that is not there yet is given", Given, "given_tracks_start_as_stated",
     {"given": lambda s, state, recording: Given.given(s, state, evolve(recording, truth=recording.truth[:1]))},
     {"start": st.just({}), "spread": st.just(dict.fromkeys(("x", "y", "vx", "vy"), 2.0)), "offset": st.just({})}),
    ("away for twice as long", ReappearingTarget, "existence_stays_a_probability",
     other(ReappearingTarget, "predict", away=lambda s: 2.0 * s.away), {}),
    ("forgotten too soon", SoughtTarget, "forgets_as_stated",
     other(SoughtTarget, "review", forget=lambda s: s.forget / 2), {}),
    ("limits exchanged", CoastLimited, "coasts_as_stated",
     other(CoastLimited, "judge", tentative=lambda s: s.confirmed, confirmed=lambda s: s.tentative), {}),
    ("areas turned over", Existence, "survives_in_its_areas",
     {"review": lambda s, memory, scan: Existence.review(s, memory, evolve(scan, place=-scan.place))}, AREA),
    ("evidence that overflows", Pda, "needs_no_evidence", {"associate": overflowing}, {}),
]  # fmt: skip
