"""Stone Soup's models by the laws of motion models and sensors; its readers as sources; tracks there and back."""

from copy import copy
from datetime import timedelta

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vedette
from support import results as reports
from support.stonesoup_tutorials import PLANE, START, moved, polar, positions, seen
from vedette.errors import ConfigError, InputError
from vedette.testing import conformance
from vedette_adapters.stonesoup import StoneSoupSource, to_stonesoup, tracks_of
from vedette_adapters.stonesoup_models import StoneSoupMotion, StoneSoupSensor

pytest.importorskip("stonesoup", reason="stonesoup is not installed: its objects were not tried")

from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
    OrnsteinUhlenbeck,
)
from stonesoup.models.transition.nonlinear import ConstantTurn
from stonesoup.reader.pandas_reader import DataFrameDetectionReader, DataFrameGroundTruthReader
from stonesoup.types.array import CovarianceMatrix, StateVector
from stonesoup.types.detection import Detection
from stonesoup.types.state import State

PLAIN = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.05), OrnsteinUhlenbeck(0.1, 0.02)])
SLOW = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.05), OrnsteinUhlenbeck(0.1, 2e-4)])
"""The longest gap of all, which is always tried, is so long that its speed is lost."""
TURNING = ConstantTurn(linear_noise_coeffs=np.array([0.1, 0.1]), turn_noise_coeff=0.01)
TURN_AXES = vedette.Space.of(x="m", vx="m/s", y="m", vy="m/s", turn_rate="rad/s")
RNG = np.random.default_rng(0)

TestLinearModel = conformance(
    StoneSoupMotion,
    known_failures={
        "any_gap_can_be_moved_over": "Stone Soup integrates numerically, and over days loses the noise of a decaying speed",
    },
    model=st.just(SLOW),
    state=st.just(PLANE),
)
TestLinearSensor = conformance(
    StoneSoupSensor, model=st.just(positions(25.0)), state=st.just(PLANE), measures=st.none(), clutter_density=st.just(1e-5)
)
TestPolarSensor = conformance(
    StoneSoupSensor,
    known_failures={
        "inverts_where_it_stands": "8 km off, differences are right to six digits, and squared to fewer",
        "platforms_in_a_batch_stand_apart": "a model of Stone Soup stands at one place",
    },
    model=st.just(polar()),
    state=st.just(PLANE),
    measures=st.none(),
    clutter_density=st.just(1e-5),
)


for laws in (TestLinearSensor, TestPolarSensor):
    pytest.mark.nightly("sensors are called a state at a time: their laws take long, and the tutorials try them too")(laws)


def test_a_turning_model_moves_as_stone_soup_moves_it():
    from stonesoup.types.state import State

    model = StoneSoupMotion(TURNING, TURN_AXES)
    x = np.array([[1.0, 2.0, 3.0, -1.0, 0.1], [0.0, -2.0, 1.0, 1.0, -0.2]])
    for row, moved_row in zip(x, model.move(x, 1.5), strict=True):
        wanted = TURNING.function(State(row[:, None]), time_interval=timedelta(seconds=1.5), noise=False)
        np.testing.assert_allclose(moved_row, np.ravel(wanted), rtol=1e-12)
    assert not model.linear
    assert model.jacobian(x, 1.5).shape == (2, 5, 5)


def test_axes_must_be_as_many_as_the_models():
    with pytest.raises(ValueError, match="state: must have 4 axes"):
        StoneSoupMotion(PLAIN, TURN_AXES)
    with pytest.raises(ValueError, match="state: must have 4 axes"):
        StoneSoupSensor(positions(), TURN_AXES)


def test_readers_of_frames_are_sources():
    pd = pytest.importorskip("pandas")
    times = [START + timedelta(seconds=2 * k) for k in range(5)]
    rows = pd.DataFrame({"when": times, "px": np.arange(5.0), "py": 3.0, "vx": 0.5, "vy": 0.0, "who": "a"})
    source = StoneSoupSource(
        DataFrameDetectionReader(dataframe=rows, state_vector_fields=["px", "py"], time_field="when"),
        "s",
        DataFrameGroundTruthReader(
            dataframe=rows, state_vector_fields=["px", "vx", "py", "vy"], time_field="when", path_id_field="who"
        ),
        PLANE,
    )
    sensors = {"s": StoneSoupSensor(positions(), PLANE)}
    for _ in range(2):  # a reader is read anew each time
        recording = source.open(sensors, RNG)
        assert [scan.time for scan in recording.scans] == [0.0, 2.0, 4.0, 6.0, 8.0]
        np.testing.assert_array_equal(recording.scans[3].detections.z, [[3.0, 3.0]])
        (truth,) = recording.truth
        assert truth.space == PLANE
        np.testing.assert_array_equal(truth.states[:, 0], np.arange(5.0))
    assert recording.notes["start of times"] == START.isoformat()


def test_detections_of_several_sensors_are_told_apart_and_in_order():
    path = moved([0, 1, 0, 1], steps=4)
    scans = seen([path, path], positions())
    names = {id(found): name for _, group in scans for found, name in zip(group, "ab", strict=True)}
    source = StoneSoupSource(scans, lambda found: names[id(found)])
    sensors = {name: StoneSoupSensor(positions(), PLANE) for name in "ab"}
    assert [scan.sensor for scan in source.open(sensors, RNG).scans] == ["a", "b"] * 4
    with pytest.raises(ConfigError, match=r"sensor: 'b' is no sensor.*'a'"):
        source.open({"a": sensors["a"]}, RNG)


def test_what_does_not_fit_is_said():
    sensors = {"s": StoneSoupSensor(positions(), PLANE)}
    with pytest.raises(InputError, match="Stone Soup gives no detections"):
        StoneSoupSource([], "s").open(sensors, RNG)
    path = moved([0, 1, 0, 1], steps=4)
    scans = seen([path], positions())
    with pytest.raises(ConfigError, match="space: must name the axes"):
        StoneSoupSource(scans, "s", [path]).open(sensors, RNG)
    with pytest.raises(InputError, match=r"states of 4 numbers.*2"):
        StoneSoupSource(scans, "s", [path], vedette.Space.of(x="m", y="m")).open(sensors, RNG)


def test_tracks_go_there_and_back():
    scans = seen([moved([0, 1, 0, 1])], positions())
    experiment = vedette.load(
        {
            "source": StoneSoupSource(scans, "s"),
            "estimator": {"kind": "kalman", "motion": StoneSoupMotion(PLAIN, PLANE)},
            "sensors": {"s": StoneSoupSensor(positions(), PLANE)},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    (track,) = experiment.run().tracks
    (there,) = to_stonesoup([track], START)
    assert there[0].timestamp == START
    (back,) = tracks_of([there], PLANE, START)
    for name in ("times", "mean", "cov"):
        np.testing.assert_array_equal(getattr(back, name), getattr(track, name))


def flying(model, place, yaw=0.0, noise=None):
    """The model at another place."""
    own = copy(model)
    own.translation_offset, own.rotation_offset = StateVector(place), StateVector([0.0, 0.0, yaw])
    if noise is not None:
        own.noise_covar = CovarianceMatrix(noise)
    return own


def test_a_detection_is_used_by_its_own_measurement_model():
    """Once it was ignored: a target seen from a moving platform was followed hundreds of m beside itself."""
    model = polar()
    sensors = {"s": StoneSoupSensor(model, PLANE)}
    pairs = []
    for k in range(30):
        time, truth = START + timedelta(seconds=k), State([100.0 + 5.0 * k, 5.0, 50.0, 0.0])
        own = flying(model, [20.0 * k, -10.0 * k], 0.02 * k, noise=np.diag([1e-6, 0.04]))
        z = own.function(truth, noise=False)
        pairs.append((time, {Detection(z, timestamp=time, measurement_model=own)}))
    scans = StoneSoupSource(pairs, "s").open(sensors, RNG).scans
    np.testing.assert_allclose(scans[9].pose.position, [180.0, -90.0])
    np.testing.assert_allclose(scans[9].detections.noise, [np.diag([1e-6, 0.04])])
    at = sensors["s"].at(scans[9].pose)
    np.testing.assert_allclose(at.measure(np.array([145.0, 50.0])), scans[9].detections.z[0], atol=1e-9)
    experiment = vedette.load(
        {
            "source": StoneSoupSource(pairs, "s"),
            "estimator": {"kind": "ekf", "motion": StoneSoupMotion(PLAIN, PLANE)},
            "sensors": sensors,
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    (track,) = experiment.run().tracks
    assert np.hypot(*(track.mean[-1, [0, 2]] - [100.0 + 5.0 * 29, 50.0])) < 3.0


@pytest.mark.parametrize("other", ["class", "mapping", "tilt"])
def test_a_model_that_the_sensor_cannot_use_is_refused(other):
    model = polar()
    own = {"class": positions(), "mapping": flying(model, [0.0, 0.0]), "tilt": flying(model, [0.0, 0.0])}[other]
    if other == "mapping":
        own.mapping = (2, 0)
    if other == "tilt":
        own.rotation_offset = StateVector([0.1, 0.0, 0.0])
    pairs = [(START, {Detection([0.1, 100.0], timestamp=START, measurement_model=own)})]
    with pytest.raises(InputError, match="measurement_model"):
        StoneSoupSource(pairs, "s").open({"s": StoneSoupSensor(model, PLANE)}, RNG)


@given(st.lists(st.floats(0.0, 1e7), min_size=1, max_size=8, unique=True), st.integers(0, 8))
def test_tracks_come_back_as_they_were_at_any_times(times, tentative):
    given_times = np.sort(times)
    if np.any(np.diff(given_times) < 2e-6):  # dates are whole microseconds
        return
    one = reports.track(given_times, np.zeros((len(times), 4)), np.eye(4), space=PLANE)
    one = attrs.evolve(one, confirmed=np.arange(len(times)) >= tentative)
    (back,) = tracks_of(to_stonesoup([one], START), PLANE, START)
    np.testing.assert_array_equal(back.times, one.times)
    np.testing.assert_array_equal(back.confirmed, one.confirmed)
    with pytest.raises(InputError, match="track '0'"):
        tracks_of(to_stonesoup([one], START), vedette.Space.of(x="m", y="m"), START)
