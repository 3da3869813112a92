"""JSON that is none of a recording's: too deep, half a character, true where a number stands."""

import json

import pytest

import vedette
from vedette.errors import InputError
from vedette_files import read_recording
from vedette_files.json_values import DEEPEST, parse

RADAR = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
    "lifecycle": {"kind": "m_of_n"},
}
SCENE = '{"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}\n'
SCENE += '{"time": 0, "sensor": "radar", "z": []}\n'


@pytest.mark.parametrize("text", ["[" * 100_000, "[" * 900 + "]" * 900, '{"a":' * 900 + "1" + "}" * 900])
def test_brackets_without_end(tmp_path, text):
    with pytest.raises(ValueError, match=r"is not JSON|levels"):
        parse(text)
    (tmp_path / "r.jsonl").write_text(SCENE + text + "\n")
    recording, _ = read_recording(tmp_path / "r.jsonl")
    assert len(recording.scans) == 1
    assert len(recording.refused) == 1


def test_the_depth_that_is_read():
    assert parse("[" * DEEPEST + "]" * DEEPEST)
    with pytest.raises(ValueError, match=f"deeper than {DEEPEST} levels"):
        parse("[" * (DEEPEST + 1) + "]" * (DEEPEST + 1))


def test_a_name_that_is_twice_in_one_object_is_refused():
    """The last one won in silence."""
    with pytest.raises(ValueError, match=r"\"time\" appears twice"):
        parse('{"z": [{"time": 1}], "time": 75, "time": 76}')
    assert parse('[{"time": 75}, {"time": 76}]')


def test_half_a_character_is_refused(tmp_path):
    """A lone surrogate cannot be printed or written: it would end the run where its name is told."""
    (tmp_path / "r.jsonl").write_text(SCENE.replace("}}}", '}}, "notes": {"a": "\\ud800"}}'))
    with pytest.raises(InputError, match="half a character"):
        read_recording(tmp_path / "r.jsonl")


@pytest.mark.parametrize("field", ["sensorID", "targetID"])
def test_true_is_no_number_of_a_sensor_or_boat(tmp_path, field):
    entry = {"sensorID": 2, "time": 1, "ownshipPosition": [0, 0], "measurement": [1, 2]}
    boat = [{"targetID": 1, "time": float(i), "position": [0, i, 0]} for i in range(3)]
    spoilt = {
        "sensorID": ([entry, entry | {"sensorID": True}], boat),
        "targetID": ([entry], [*boat, boat[0] | {"targetID": True}]),
    }
    for part, data in zip(("detections", "groundTruth"), spoilt[field], strict=True):
        (tmp_path / f"scenario1_{part}.json").write_text(json.dumps(data))
    source = {"kind": "autoferry", "scenario": 1, "path": str(tmp_path), "sensors": ["radar"]}
    (problem,) = vedette.load(RADAR | {"source": source}).run().recording.refused
    assert field in str(problem)
