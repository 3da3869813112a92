"""Packed scans are those that were put in, to the last bit and in any order, and take little more than their numbers."""

import tracemalloc

import numpy as np
from attrs import fields
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Detections, Frame, Pose, Scan
from vedette_files.packed import PackedScans


def equal(one, other):
    """Return whether two values hold the same, bit by bit."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, Scan | Detections | Pose):
        return type(one) is type(other) and all(
            equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(type(one))
        )
    return one is other or one == other


@st.composite
def scans(draw):
    k, m, rng = draw(st.integers(0, 3)), draw(st.integers(1, 3)), np.random.default_rng(draw(st.integers(0, 9)))
    pose = None
    if d := draw(st.sampled_from([0, 2, 3])):
        pose = Pose(rng.normal(size=d), rng.normal(size=d) if draw(st.booleans()) else None, rng.normal())
    if draw(st.integers(0, 9)) == 0:
        return Scan.image(0.5, "camera", Frame(rng.normal(size=(2, 2))))
    own = {
        "evidence": rng.normal(size=k),
        "noise": rng.normal(size=(k, m, m)),
        "missing": rng.random((k, m)) < 0.5,
        "identity": rng.integers(-1, 2**60, k),
        "time": rng.normal(size=k),
    }
    some = {name: values for name, values in own.items() if draw(st.booleans())}
    seen = Detections(rng.normal(size=(k, m)), rng.random(k) < 0.8, **some)
    return Scan(float(rng.normal()), draw(st.sampled_from("ab")), seen, pose)


@settings(max_examples=60)
@given(several=st.lists(scans(), max_size=6), data=st.data())
def test_scans_come_back_to_the_last_bit_in_any_order(several, data):
    packed = PackedScans(several)
    assert len(packed) == len(several)
    assert all(map(equal, packed, several))
    order = data.draw(st.permutations(range(len(several))))
    turned = packed.ordered(np.array(order, dtype=np.intp))
    assert all(equal(turned[i], several[k]) for i, k in enumerate(order))
    own = [k for k in order if several[k].sensor == "a"]
    assert all(map(equal, turned.of({"a"}), [several[k] for k in own]))
    assert len(turned.of({"a"})) == len(own)
    assert all(map(equal, packed[1:3], several[1:3]))


def test_a_scan_takes_a_tenth_of_what_it_takes_alone():
    def made():
        return (Scan(float(i), "radar", Detections.of([[1.0 * i, 2.0]])) for i in range(2000))

    def size(kind):
        tracemalloc.start()
        kept = kind(made())
        size, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return size / len(kept)

    assert size(PackedScans) < 0.1 * size(tuple)
