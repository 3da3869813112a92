"""Vedette's own recordings: what is written reads back to the last bit, and what each fault costs."""

import json
import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vedette import Recording, Space, Trajectory
from vedette.errors import ConfigError, InputError
from vedette.types import Detections, Pose, Scan
from vedette_files import JsonLinesSource, read_recording, write_recording
from vedette_files.packed import PackedScans
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
POLAR = Space.of(range="m", bearing="rad mod 2pi")
PLANE = Space.of(x="m", y="m")
SPACES = {"radar": POLAR, "camera": Space.of(bearing="rad mod 2pi")}
HEADER = {"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}, "truth": {"a": {"x": "m"}}}
GOOD = {"time": 1.0, "sensor": "radar", "z": [[1.0, 2.0]]}
NUMBERS = st.floats(-1e15, 1e15)  # subnormal numbers and -0.0 among them


@st.composite
def poses(draw):
    d = draw(st.sampled_from([2, 3]))
    velocity = draw(st.none() | arrays(float, d, elements=NUMBERS))
    return Pose(draw(arrays(float, d, elements=NUMBERS)), velocity, draw(NUMBERS))


@st.composite
def scans(draw, time):
    name = draw(st.sampled_from(sorted(SPACES)))
    k, m = draw(st.integers(0, 3)), len(SPACES[name])
    evidence = draw(st.none() | arrays(float, k, elements=NUMBERS))
    noise = draw(st.none() | arrays(float, (k, m, m), elements=NUMBERS))
    own = draw(st.none() | arrays(float, k, elements=st.floats(-1e15, time)))
    z = draw(arrays(float, (k, m), elements=NUMBERS))
    detections = Detections(z, np.ones(k, dtype=bool), evidence, noise, time=own)
    return Scan(time, name, detections, draw(st.none() | poses()))


@st.composite
def recordings(draw):
    times = sorted(draw(st.lists(NUMBERS, max_size=6)))
    names = draw(st.lists(st.text(), max_size=2, unique=True))
    truth = []
    for name in names:
        count = draw(st.integers(1, 4))
        stamps = np.sort(draw(arrays(float, count, elements=NUMBERS)))
        truth.append(Trajectory(name, POLAR, stamps, draw(arrays(float, (count, 2), elements=NUMBERS))))
    notes = draw(st.dictionaries(st.text(), st.text(), max_size=2))
    return Recording(tuple(draw(scans(time)) for time in times), tuple(truth), (), notes)


def bits(value):
    """Something equal only if every float in `value` has the same bits."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, float):
        return np.float64(value).tobytes()
    if isinstance(value, tuple | PackedScans):
        return [bits(part) for part in value]
    if isinstance(value, Scan | Detections | Pose | Trajectory | Recording):
        return {name: bits(getattr(value, name)) for name in value.__slots__ if name not in ("__weakref__", "rows")}
    return value


@settings(max_examples=150)
@given(recording=recordings())
@pytest.mark.costly
def test_what_is_written_reads_back_to_the_last_bit(tmp_path_factory, recording):
    folder = tmp_path_factory.mktemp("jsonl")
    write_recording(folder / "r.jsonl", recording, SPACES)
    again, spaces = read_recording(folder / "r.jsonl")
    assert spaces == SPACES
    assert bits(again) == bits(recording)
    write_recording(folder / "again.jsonl", again, spaces)
    assert (folder / "again.jsonl").read_bytes() == (folder / "r.jsonl").read_bytes()
    assert b"\r" not in (folder / "r.jsonl").read_bytes()


def example():
    truth = Trajectory("a", PLANE, np.array([0.0, 1.0]), np.array([[1.0, 2.0], [3.0, 4.0]]))
    seen = [Detections.of([[10.0 + i, 0.1]]) for i in range(2)]
    return Recording(tuple(Scan(float(i), "radar", found, Pose(np.zeros(2))) for i, found in enumerate(seen)), (truth,))


def test_a_file_cut_anywhere_loses_no_whole_line_before_the_cut(tmp_path):
    whole = tmp_path / "r.jsonl"
    write_recording(whole, example(), SPACES)
    text = whole.read_bytes()
    header = text.index(b"\n")
    for end in range(header, len(text)):
        whole.write_bytes(text[:end])
        recording, _ = read_recording(whole)
        complete = text.count(b"\n", header + 1, end + 1)  # a line is whole without its end too
        cut_short = text[end - 1 : end] != b"\n" and text[end : end + 1] != b"\n"
        assert sum(len(true.times) for true in recording.truth) + len(recording.scans) == complete, text[:end]
        assert len(recording.refused) == cut_short, text[:end]


def test_padding_is_not_written(tmp_path):
    detections = Detections(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([False, True]), np.array([3.0, 4.0]))
    write_recording(tmp_path / "r.jsonl", Recording((Scan(0.0, "radar", detections),)), SPACES)
    (scan,) = read_recording(tmp_path / "r.jsonl")[0].scans
    assert (scan.detections.z.tolist(), scan.detections.evidence.tolist()) == ([[2, 0]], [4])


def test_a_return_of_after_its_scan_is_left_out(tmp_path):
    recording = read(tmp_path, HEADER, GOOD | {"z": [[1.0, 2.0], [3.0, 4.0]], "times": [1.5, 0.5]})
    assert recording.scans[0].detections.time.tolist() == [0.5]
    assert [problem.place for problem in recording.refused] == ["r.jsonl:2"]


def with_z(z):
    return Recording((Scan(0.0, "radar", Detections.of(z)),))


UNWRITABLE = {
    "NaN": (with_z([[1.0, math.nan]]), "not JSON compliant"),
    "batch": (with_z(np.zeros((2, 1, 2))), "z (2, 1, 2) is not (returns, axes)"),
    "wrong axes": (with_z([[1.0, 2.0, 3.0]]), "z (1, 3) is not (returns, axes)"),
    "unknown sensor": (Recording((Scan(0.0, "sonar", Detections.of([], 2)),)), "scan of 'sonar'"),
    "two of a name": (evolve(example(), truth=example().truth * 2), "two true objects share a name"),
}


@pytest.mark.parametrize(("recording", "text"), UNWRITABLE.values(), ids=UNWRITABLE)
def test_what_cannot_be_written_leaves_what_was_there(tmp_path, recording, text):
    (tmp_path / "r.jsonl").write_text("before")
    with pytest.raises(ValueError) as caught:  # noqa: PT011  # the text is what is tested
        write_recording(tmp_path / "r.jsonl", recording, SPACES)
    assert text in str(caught.value)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("r.jsonl", "before")]


def test_an_interrupted_write_leaves_what_was_there(tmp_path):
    class Interrupting(dict):
        def get(self, *_):
            raise KeyboardInterrupt

        __contains__ = __getitem__ = get

    (tmp_path / "r.jsonl").write_text("before")
    with pytest.raises(KeyboardInterrupt):
        write_recording(tmp_path / "r.jsonl", example(), Interrupting())
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("r.jsonl", "before")]


def read(folder, *entries):
    texts = [entry if isinstance(entry, str) else json.dumps(entry) for entry in entries]
    (folder / "r.jsonl").write_text("".join(f"{text}\n" for text in texts))
    return read_recording(folder / "r.jsonl")[0]


def test_sensors_may_interleave_and_each_keeps_its_order(tmp_path):
    header = HEADER | {"sensors": {"radar": {"x": "m"}, "camera": {"x": "m"}}}
    told = [(1.0, "camera"), (2.0, "camera"), (2.0, "radar"), (1.5, "radar"), (3.0, "radar"), (2.5, "camera")]
    entries = [{"time": time, "sensor": name, "z": [[float(i)]]} for i, (time, name) in enumerate(told)]
    recording = read(tmp_path, header, *entries)
    assert [(scan.time, scan.detections.z[0, 0]) for scan in recording.scans] == [(1, 0), (2, 1), (2, 2), (2.5, 5), (3, 4)]
    (problem,) = recording.refused
    assert str(problem) == "r.jsonl:5: time 1.5 s is out of order: it stands after 2.0 s and before 3.0 s"


BAD_LINES = {
    "not JSON": ('{"time": 1.0,', "is not JSON, or cut short, at column 14"),
    "text": ("time", "is not JSON, or cut short, at column 1"),
    "too deep": ("[" * 100_000, "is nested deeper than 32 levels"),
    "no object": ("3", "must be an object, got 3"),
    "unknown field": (GOOD | {"speed": 3}, "unknown field 'speed'; known are time, sensor, z, noise, evidence, pose"),
    "unknown sensor": (GOOD | {"sensor": "sonar"}, "sensor must be one of the header's, 'radar', got \"sonar\""),
    "no time": ({"sensor": "radar", "z": []}, "time must be a finite number of at most 1e+15, got null"),
    "time true": (GOOD | {"time": True}, "time must be a finite number of at most 1e+15, got true"),
    "absurd time": (GOOD | {"time": 1e300}, "time must be a finite number of at most 1e+15, got 1e+300"),
    "no z": ({"time": 1.0, "sensor": "radar"}, "z must be a list with one entry a return, got null"),
    "flat z": (GOOD | {"z": [1.0]}, "z[0] must be a list of 2 numbers, got 1.0"),
    "short noise": (GOOD | {"noise": []}, "noise must be a list with one entry a return, got []"),
    "evidence alone": (GOOD | {"evidence": 3.0}, "evidence must be a list with one entry a return, got 3.0"),
    "pose that is no object": (GOOD | {"pose": [0, 0]}, "pose must be an object with position, velocity, heading"),
    "pose without position": (GOOD | {"pose": {}}, "pose.position must be a list of numbers, got null"),
    "pose on a line": (GOOD | {"pose": {"position": [0]}}, "pose.position must be a list of 2 or 3 numbers, got [0.0]"),
    "flat velocity": (GOOD | {"pose": {"position": [0, 0, 0], "velocity": [0, 0]}}, "pose.velocity must be a list of 3"),
    "pose with more": (GOOD | {"pose": {"position": [0, 0], "roll": 1}}, "unknown field pose.'roll'"),
    "heading": (GOOD | {"pose": {"position": [0, 0], "heading": "N"}}, "pose.heading must be a finite number"),
    "unknown truth": ({"truth": "b", "time": 1.0, "state": [1.0]}, "truth must be one of the header's, 'a', got \"b\""),
    "truth that is a list": ({"truth": [], "time": 1.0, "state": [1.0]}, "truth must be one of the header's"),
    "short state": ({"truth": "a", "time": 1.0, "state": []}, "state must be a list of 1 numbers, got []"),
    "state NaN": ({"truth": "a", "time": 1.0, "state": [math.nan]}, "state[0] must be a finite number"),
}


@pytest.mark.parametrize(("bad", "text"), BAD_LINES.values(), ids=BAD_LINES)
def test_a_bad_line_is_refused_by_itself(tmp_path, bad, text):
    recording = read(tmp_path, HEADER, GOOD, bad, "", GOOD)
    assert [scan.detections.z.tolist() for scan in recording.scans] == [[[1, 2]]] * 2
    (problem,) = recording.refused
    assert problem.place == "r.jsonl:3"
    assert problem.text.startswith(text)


def test_bad_returns_are_refused_by_themselves(tmp_path):
    eye = [[1.0, 0.0], [0.0, 1.0]]
    entry = {
        "time": 1.0,
        "sensor": "radar",
        "z": [[1.0, 2.0], [1.0, math.nan], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]],
        "noise": [eye, eye, [[1.0, 0.0]], eye, eye],
        "evidence": [0.5, 0.5, 0.5, "high", 0.25],
    }
    recording = read(tmp_path, HEADER, entry)
    (scan,) = recording.scans
    assert scan.detections.z.tolist() == [[1, 2], [7, 8]]
    assert scan.detections.noise.tolist() == [eye, eye]
    assert scan.detections.evidence.tolist() == [0.5, 0.25]
    told = [(problem.text.split()[0], problem.text.partition("got ")[2]) for problem in recording.refused]
    assert told == [("z[1][1]", "NaN"), ("noise[2]", "[[1.0, 0.0]]"), ("evidence[3]", '"high"')]


BAD_HEADERS = {
    "another format": ({"format": "csv"}, "r.jsonl:1: the first line must be a header"),
    "no header": (GOOD, 'r.jsonl:1: the first line must be a header {"format": "vedette", "version": ...}'),
    "not JSON": ("time,x,y", "r.jsonl:1: is not JSON, or cut short, at column 1"),
    "a list": ([], "r.jsonl:1: the first line must be a header"),
    "another version": (HEADER | {"version": 2}, "this Vedette reads version 1 of the format, the file is of 2"),
    "unknown field": (
        HEADER | {"sensor": {}},
        "unknown field 'sensor'; known are format, version, sensors, detected, truth, nobody, notes",
    ),
    "no sensors": ({"format": "vedette", "version": 1}, "the header must name the sensors"),
    "sensors that are a list": (HEADER | {"sensors": ["radar"]}, 'sensors must be names to axes, got ["radar"]'),
    "axes without units": (HEADER | {"sensors": {"radar": ["x"]}}, 'sensors.radar must be axis names to units, got ["x"]'),
    "no axes": (HEADER | {"sensors": {"radar": {}}}, "sensors.radar must be axis names to units, got {}"),
    "period": (HEADER | {"sensors": {"radar": {"b": "deg mod 360"}}}, "sensors.radar: b: the period must be '2pi'"),
    "axis named cls": (HEADER | {"sensors": {"radar": {"cls": "m"}}}, "sensors.radar: "),
    "notes": (HEADER | {"notes": {"a": 1}}, 'notes must be names to strings, got {"a": 1}'),
}


@pytest.mark.parametrize(("header", "text"), BAD_HEADERS.values(), ids=BAD_HEADERS)
def test_a_bad_header_refuses_the_file(tmp_path, header, text):
    with pytest.raises(InputError) as caught:
        read(tmp_path, header, GOOD)
    assert text in str(caught.value)


def test_an_empty_file_and_none_are_told_by_one_place(tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path)
    assert str(caught.value) == f"{tmp_path / 'r.jsonl'}: is empty"
    with pytest.raises(InputError) as caught:
        read_recording(tmp_path / "none.jsonl")
    assert str(caught.value) == f"{tmp_path / 'none.jsonl'}: cannot be read: No such file or directory"


def opened(folder, recording, sensors, spaces):
    write_recording(folder / "r.jsonl", recording, spaces)
    return JsonLinesSource(path=str(folder / "r.jsonl")).open(sensors, RNG)


def test_the_source_leaves_out_sensors_that_the_tracker_lacks(tmp_path):
    camera = Scan(0.5, "camera", Detections.of([[0.25]]))
    recording = evolve(example(), scans=(*example().scans, camera), notes={"seed": "1"})
    sensors = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}
    opened_again = opened(tmp_path, recording, sensors, SPACES)
    assert bits(opened_again.scans) == bits(example().scans)
    assert dict(opened_again.notes) == {"seed": "1", "scans of 'camera', which the tracker lacks": "1"}


def test_the_source_puts_axes_in_the_sensors_order(tmp_path):
    noise = np.array([[[1.0, 2.0], [3.0, 4.0]]])
    scan = Scan(0.0, "radar", evolve(Detections.of([[5.0, 6.0]]), noise=noise))
    sensors = {"radar": CartesianPosition(sigma=1.0)}
    (again,) = opened(tmp_path, Recording((scan,)), sensors, {"radar": Space.of(y="m", x="m")}).scans
    assert again.detections.z.tolist() == [[6, 5]]
    assert again.detections.noise.tolist() == [[[4, 3], [2, 1]]]


def test_axes_that_the_sensor_does_not_measure(tmp_path):
    with pytest.raises(InputError, match=r"r\.jsonl:1: sensor 'radar' gives \(range .* the tracker's measures \(x"):
        opened(tmp_path, example(), {"radar": CartesianPosition(sigma=1.0)}, SPACES)


def test_no_scan_of_the_trackers_sensors(tmp_path):
    with pytest.raises(InputError, match=r"holds no usable scan of 'sonar'.*'camera'"):
        opened(tmp_path, example(), {"sonar": CartesianPosition(sigma=1.0)}, SPACES)


def test_without_the_recording_the_error_says_what_it_is():
    with pytest.raises(ConfigError, match=r"path: is not given\. Wanted: sea trial 4\."):
        JsonLinesSource(about="sea trial 4").open({}, RNG)
