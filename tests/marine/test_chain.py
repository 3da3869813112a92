"""Radar pictures to returns: beacons, rain, places, noise, evidence, and what bad pictures do."""

import math

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.spots import picture
from vedette import ConfigError, Frame, InputError, Pose, Scan
from vedette_marine.geometry import PictureGeometry
from vedette_marine.picture.artefacts import rain, spokes
from vedette_marine.picture.chain import Chain, right_ahead
from vedette_marine.picture.colours import Palette
from vedette_marine.picture.evidence import Evidence, Excess
from vedette_marine.picture.inspection import sheet, stage_pictures
from vedette_marine.preprocessors.radar_picture import RadarPicture
from vedette_marine.screen import RadarScreen

cv2 = pytest.importorskip("cv2")
SIZE = 400
GEOMETRY = PictureGeometry(5.0, [199.5, 199.5], SIZE, SIZE, range=990.0, colours=[[0, 0, 0], [0, 255, 0], [255, 255, 0]])


def scan(pixels, geometry=GEOMETRY, pose=None, **more):
    channels = np.moveaxis(pixels, -1, 0) if pixels.ndim == 3 else pixels
    known = None if geometry is None else geometry.as_json() | more
    return evolve(Scan.image(1.0, "screen", Frame(channels, geometry=known)), pose=pose)


def preprocessor(**more):
    return RadarPicture({"screen": RadarScreen()}, **more)


def returns(pixels, made=None, **more):
    return (made or preprocessor()).process({"screen": scan(pixels, **more)})


# Beacons and rain.
def test_a_beacon_s_spoke_is_flagged_and_a_ship_and_a_coast_are_not():
    above = np.zeros((SIZE, SIZE), dtype=np.uint8)
    cv2.line(above, (240, 160), (330, 70), 1, 4)  # 640 m of a bearing
    cv2.line(above, (60, 100), (90, 100), 1, 5)  # a ship of 150 m
    cv2.ellipse(above, (200, 200), (180, 180), 0, 60, 120, 1, -1)  # land: echoes over all ranges, at many bearings
    found = spokes(above > 0, right_ahead(GEOMETRY), math.radians(1.2), 400.0, 100.0)
    assert found[115, 285]
    assert not found[95:106, 55:95].any()
    assert found[220:].mean() < 0.01


def test_rain_is_dense_over_a_wide_area():
    rng = np.random.default_rng(2)
    above = (rng.random((SIZE, SIZE)) < 0.02).astype(np.uint8)
    above[100:220, 100:220] |= (rng.random((120, 120)) < 0.5).astype(np.uint8)
    above[300:303, 300:330] = 1
    found = rain(above, 60, 0.25)
    assert found[130:190, 130:190].all()
    assert not found[290:310, 290:340].any()


# The preprocessor.
SPOTS = ((300.3, 140.7), (101.5, 260.0))


@pytest.mark.parametrize("colours", [None, GEOMETRY.colours])
@pytest.mark.parametrize("derivatives", ["masks", "exact"])
def test_spots_become_returns_where_they_are(colours, derivatives):
    made = returns(picture(SPOTS, colours), preprocessor(chain=Chain(derivatives=derivatives)))
    expected = GEOMETRY.from_antenna(np.array(SPOTS))
    assert len(made.z) == 2
    np.testing.assert_allclose(made.z[np.argsort(-made.z[:, 0])], expected, atol=2.0)  # .4 px


@pytest.mark.parametrize("up", ["north-up", "head-up"])
def test_own_ship_s_place_and_heading_count(up):
    pose = Pose(np.array([1000.0, -2000.0]), heading=math.radians(30))  # 60 degrees clockwise from north
    geometry = evolve(GEOMETRY, stabilisation=up)
    made = returns(picture(SPOTS[:1]), geometry=geometry, pose=pose)
    right, ahead = 5 * (SPOTS[0][0] - 199.5), 5 * (199.5 - SPOTS[0][1])
    h = math.radians(60) if up == "head-up" else 0.0
    east, north = right * math.cos(h) + ahead * math.sin(h), ahead * math.cos(h) - right * math.sin(h)
    np.testing.assert_allclose(made.z, [[1000 + east, -2000 + north]], atol=2.0)


def test_noise_grows_across_the_line_of_sight_and_with_a_ship_s_extent():
    plain = returns(picture(SPOTS[:1]), preprocessor(sigma=6.0)).noise[0]
    np.testing.assert_allclose(plain, 36 * np.eye(2), atol=1e-9)
    polar = returns(picture(SPOTS[:1]), preprocessor(sigma=6.0, sigma_bearing="1 deg"))
    line = polar.z[0] / np.linalg.norm(polar.z[0])
    assert line @ polar.noise[0] @ line == pytest.approx(36, rel=1e-6)
    across = np.array([-line[1], line[0]])
    assert across @ polar.noise[0] @ across == pytest.approx(36 + (np.linalg.norm(polar.z) * math.radians(1)) ** 2, rel=1e-6)
    long = [(x, 150.0) for x in range(100, 140, 6)]  # a ridge: blobs at its ends, so the link is its length
    seen = returns(picture(long), preprocessor(sigma=6.0, extent=0.5, chain=Chain(link=200.0, longest=400.0)))
    assert len(seen.z) == 1
    assert seen.noise[0, 0, 0] > 36 + 0.25 * (5 * 14) ** 2 > 200 > seen.noise[0, 1, 1]


def test_evidence_is_the_log_likelihood_ratio_of_brightness_and_size():
    from scipy import stats

    excess = np.array([0.0, 10.0, 150.0])
    expected = stats.expon(scale=80).logpdf(excess) - stats.expon(scale=15).logpdf(excess)
    np.testing.assert_allclose(Excess(15, 80).ratio(excess), expected)
    ship, spike = SPOTS
    seen = picture([ship]).astype(float)
    seen[round(spike[1]) :, round(spike[0]) :][:2, :2] = 190
    made = {
        name: returns(seen.astype(np.uint8), preprocessor(evidence=Evidence(**given)))
        for name, given in {
            "brightness": {"brightness": Excess(30, 120)},
            "size": {"size": Excess(1, 8)},
            "both": {"brightness": Excess(30, 120), "size": Excess(1, 8)},
            "neither": {},
        }.items()
    }
    order = np.argsort(-made["both"].z[:, 0])
    brightness, size = made["brightness"].evidence[order], made["size"].evidence[order]
    np.testing.assert_allclose(made["both"].evidence[order], brightness + size)
    assert brightness[0] > brightness[1] == pytest.approx(Excess(30, 120).ratio(np.array(190.0 - 90)))
    assert size[0] > 0.3
    assert size[1] == pytest.approx(math.log(1 / 8))  # a point is as small as can be
    assert not made["neither"].evidence.any()
    assert returns(picture(SPOTS)).evidence is None


def test_the_interface_is_not_seen():
    """White letters, blue rings, and a box of the interface in an echo's own colour."""
    coloured = picture(SPOTS, GEOMETRY.colours)
    cv2.putText(coloured, "RANGE 1 NM", (120, 320), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (255, 255, 255), 2)
    cv2.circle(coloured, (200, 200), 150, (200, 60, 0), 2)
    coloured[200:230, 300:340] = (0, 255, 200)
    made = returns(coloured, geometry=evolve(GEOMETRY, overlays=[[300, 200, 40, 30]]))
    assert len(made.z) == 2
    assert len(returns(coloured).z) > 2  # the box is seen where the geometry does not name it


@pytest.mark.parametrize("line", [(100, 0, 101, 399), (0, 150, 399, 151), (0, 0, 399, 399)])
def test_a_line_of_the_interface_does_not_cut_a_ship_in_two(line):
    """A heading line or a ring of two pixels over a ship of 80 m: one return, within 1.6 px of where it is without."""
    rows, columns = np.mgrid[:SIZE, :SIZE]
    (x, y), (wide, high) = (
        ((250, 150), (2, 6)) if line[1] == 150 else ((100, 250), (6, 2)) if line[0] else ((250, 250), (6, 2))
    )
    ship = (300 * np.exp(-0.5 * ((columns - x) / wide) ** 2 - 0.5 * ((rows - y) / high) ** 2)).clip(0, 255).astype(np.uint8)
    plain = np.zeros((SIZE, SIZE, 3), dtype=np.uint8)
    plain[..., 1:] = ship[..., None]
    plain[..., 2] = np.where(ship > 127, 2.0 * ship - 255.0, 0)  # black, green, yellow
    plain[..., 1] = np.minimum(2.0 * ship, 255)
    crossed = plain.copy()
    cv2.line(crossed, line[:2], line[2:], (200, 60, 0), 2)
    made = preprocessor(chain=Chain(link=20.0))
    assert len(returns(crossed, made).z) == 1
    np.testing.assert_allclose(returns(crossed, made).z, returns(plain, made).z, atol=8.0)
    assert len(returns(np.where(np.all(crossed == (200, 60, 0), axis=-1), 0, ship).astype(np.uint8), made).z) == 2
    crossed[ship > 0] = 0
    assert len(returns(crossed, made).z) == 0  # no echo is made of a line


def test_land_hides_what_lies_on_it_and_moves_with_own_ship():
    land = np.zeros((SIZE, SIZE), dtype=np.uint8)
    land[240:280, 80:120] = 255
    assert len(returns(picture(SPOTS), land=land).z) == 1
    away = Pose(np.array([500.0, 0.0]), heading=math.pi / 2)
    assert len(returns(picture(SPOTS), land=land, pose=away).z) == 2
    moved = [SPOTS[0], (101.5 - 40, 260.0)]  # own ship 200 m east: the land lies 40 px farther left
    assert len(returns(picture(moved), land=land, pose=Pose(np.array([200.0, 0.0]), heading=math.pi / 2)).z) == 1


def test_a_palette_gives_back_its_own_levels():
    palette = Palette.of(GEOMETRY.colours, 48.0)
    levels = np.arange(256)
    line = np.stack([np.interp(np.linspace(0, 2, 256), range(3), c) for c in GEOMETRY.colours.T], axis=-1)
    found = palette.grey(line[:, ::-1].astype(np.uint8)[None])[0].astype(int)
    assert np.max(np.abs(found - levels)) <= 5
    assert palette.grey(np.array([[[255, 255, 255], [255, 0, 0], [255, 0, 255]]], dtype=np.uint8)).max() == 0


def test_stages_can_be_looked_at():
    stages = preprocessor().stages(scan(picture(SPOTS, GEOMETRY.colours)).frame, None)
    pictures = stage_pictures(stages)
    assert [name[0] for name in pictures] == list("12345")
    assert all(each.shape == (SIZE, SIZE, 3) for each in pictures.values())
    six = {"0 screen": pictures["1 grey"]} | pictures
    plain, magnified = sheet(six, None), sheet(six, np.array(SPOTS[0]))
    assert plain.shape == magnified.shape == (2 * SIZE, 3 * SIZE, 3)
    corner = np.s_[SIZE - 120 : SIZE - 4, SIZE - 120 : SIZE - 4]
    assert np.mean(magnified[corner]) > 2 * np.mean(plain[corner])  # the spot, large


@pytest.mark.parametrize("pixels", [np.zeros((SIZE, SIZE), dtype=np.uint8), np.full((SIZE, SIZE), 255, dtype=np.uint8)])
def test_black_and_white_pictures_have_no_returns(pixels):
    assert len(returns(pixels).z) == 0
    assert len(preprocessor().process({"screen": Scan(0.0, "screen", vedette.Detections.of([], 2))}).z) == 0


def test_pictures_that_cannot_be_used_are_told():
    with pytest.raises(ConfigError, match="come without a geometry"):
        returns(picture(SPOTS), geometry=None)
    assert len(returns(picture(SPOTS), preprocessor(geometry=GEOMETRY), geometry=None).z) == 2
    with pytest.raises(InputError, match=r"is of 400 x 400 px, the picture.*300"):
        returns(picture([], size=300))
    with pytest.raises(InputError, match="must be 8 bit"):
        returns(picture(SPOTS).astype(np.uint16))
    with pytest.raises(InputError, match="geometry of a picture: metres_per_pixel"):
        returns(picture(SPOTS), metres_per_pixel=-1)
    with pytest.raises(ValueError, match="scales: must rise"):
        Chain(scales=[3.0, 2.0])
