"""Pixels and places of a radar picture, and its sidecar."""

import json
import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import InputError, Pose
from vedette_marine.geometry import PictureGeometry, nautical, read_geometry, write_geometry

SIZE = 400
GEOMETRY = PictureGeometry(5.0, [199.5, 199.5], SIZE, SIZE, range=990.0, colours=[[0, 0, 0], [0, 255, 0], [255, 255, 0]])


# Geometry.
@given(
    st.sampled_from(["north-up", "head-up"]),
    st.floats(-10, 10),
    st.lists(st.tuples(st.floats(-500, 900), st.floats(-500, 900)), min_size=1, max_size=4),
)
@settings(max_examples=60)
def test_pixels_and_places_are_each_other_s_inverse(up, heading, pixels):
    geometry = evolve(GEOMETRY, stabilisation=up)
    at = np.array(pixels)
    places = geometry.from_antenna(at, heading)
    np.testing.assert_allclose(geometry.to_pixels(places, heading), at, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), 5 * np.linalg.norm(at - 199.5, axis=1), rtol=1e-9, atol=1e-9)


def test_up_is_north_or_ahead():
    up = np.array([[199.5, 99.5]])
    np.testing.assert_allclose(GEOMETRY.from_antenna(up, 1.0), [[0, 500]], atol=1e-9)
    ahead = evolve(GEOMETRY, stabilisation="head-up").from_antenna(up, math.pi / 2)
    np.testing.assert_allclose(ahead, [[500, 0]], atol=1e-9)  # the bow points east
    assert nautical(Pose(np.zeros(2), heading=0.0)) == pytest.approx(math.pi / 2)  # a pose counts from east, to port


def test_the_sidecar_gives_back_the_geometry(tmp_path):
    full = evolve(GEOMETRY, latitude=35.0, longitude=129.0, overlays=[[0, 0, 50, 20]], land="land.png")
    write_geometry(tmp_path, full)
    assert read_geometry(tmp_path) == full


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"metres_per_pixel": -3}, "metres_per_pixel: must be > 0, got -3 m"),
        ({"metres_per_pixel": None}, "metres_per_pixel: "),
        ({"centre": [1, 2, 3]}, r"centre: must be \[x, y\]"),
        ({"stabilisation": "up"}, "stabilisation: must be one of"),
        ({"colour": 3}, "colour: there is no such field"),
        ({"overlays": [[1, 2, 0, 4]]}, "overlays: must hold"),
        ({"width": "wide"}, "width: "),
        ({"colours": [[0, 0, 300], [1, 1, 1]]}, "colours: must hold"),
    ],
)
def test_a_wrong_sidecar_is_told_with_its_field(tmp_path, change, message):
    (tmp_path / "geometry.json").write_text(json.dumps(GEOMETRY.as_json() | change))
    with pytest.raises(InputError, match=f"geometry.json: {message}"):
        read_geometry(tmp_path)


@pytest.mark.parametrize("text", ["", "[1, 2]", "{", '{"metres_per_pixel": 5}', "\x00\xff"])
def test_a_sidecar_that_is_none_is_told(tmp_path, text):
    (tmp_path / "geometry.json").write_text(text)
    with pytest.raises(InputError, match=r"geometry.json: "):
        read_geometry(tmp_path)
    (tmp_path / "geometry.json").unlink()
    with pytest.raises(InputError, match="is missing: it states where"):
        read_geometry(tmp_path)
