"""The endurance benchmark sees what it is to see: the memory along a run, and ids that are used again."""

import json

from benchmarks.endurance import follow, harbour


def test_a_short_run_is_followed():
    found = follow(json.loads(json.dumps(harbour(40, 3))), samples=10)
    assert found["scans"] == 40
    assert len(found["mb"]) >= 10
    assert 3 <= found["confirmed"] <= found["begun"]
    assert found["reused_ids"] == 0


def test_one_track_is_one():
    found = follow(harbour(40, 1, keeps=True), samples=10)
    assert found["scans"] == 40
    assert found["begun"] == 1
