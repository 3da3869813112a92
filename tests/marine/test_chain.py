"""Radar pictures to returns: geometry, each stage against an oracle, and what bad pictures do."""

import json
import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette import ConfigError, Frame, InputError, Pose, Scan
from vedette_marine.geometry import PictureGeometry, nautical, read_geometry, write_geometry
from vedette_marine.picture.artefacts import rain, spokes
from vedette_marine.picture.blobs import BLOCK, determinants, find_blobs, hessian_exact, surroundings
from vedette_marine.picture.chain import Chain, right_ahead
from vedette_marine.picture.clusters import calinski_harabasz, grouped, k_means, linked
from vedette_marine.picture.colours import Palette
from vedette_marine.picture.evidence import Evidence, Excess
from vedette_marine.picture.looking import sheet, stage_pictures
from vedette_marine.preprocessors.radar_picture import RadarPicture
from vedette_marine.screen import RadarScreen

cv2 = pytest.importorskip("cv2")

SIZE = 400
GEOMETRY = PictureGeometry(5.0, [199.5, 199.5], SIZE, SIZE, range=990.0, colours=[[0, 0, 0], [0, 255, 0], [255, 255, 0]])
SCALES = (1.5, 2.1, 3.0, 4.2, 6.0)


def picture(spots, colours=None, size=SIZE, noise=15.0):
    """Grey (h, w), or in colours (h, w, 3), with a bright spot of 15 x 10 m at each place in px, over dim speckle."""
    rows, columns = np.mgrid[:size, :size]
    grey = np.random.default_rng(0).exponential(noise, (size, size)).clip(0, 80)
    for x, y in spots:
        grey += 220 * np.exp(-0.5 * ((columns - x) / 3.0) ** 2 - 0.5 * ((rows - y) / 2.0) ** 2)
    grey = grey.clip(0, 255).astype(np.uint8)
    if colours is None:
        return grey
    line = np.stack([np.interp(np.linspace(0, 2, 256), range(3), c) for c in colours.T], axis=-1)[:, ::-1]
    return line.astype(np.uint8)[grey]


def scan(pixels, geometry=GEOMETRY, pose=None, **more):
    channels = np.moveaxis(pixels, -1, 0) if pixels.ndim == 3 else pixels
    known = None if geometry is None else geometry.as_json() | more
    return evolve(Scan.image(1.0, "screen", Frame(channels, geometry=known)), pose=pose)


def preprocessor(**more):
    return RadarPicture({"screen": RadarScreen()}, **more)


def returns(pixels, made=None, **more):
    return (made or preprocessor()).process({"screen": scan(pixels, **more)})


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
    with pytest.raises(InputError, match="is missing: without it no pixel has a place"):
        read_geometry(tmp_path)


# Blobs.


@pytest.mark.parametrize("sigma", SCALES)
def test_the_exact_hessian_is_scipy_s(sigma):
    """Within .4 % of the greatest determinant of what gaussian_filter gives: both sample the Gaussian's derivatives."""
    from scipy.ndimage import gaussian_filter

    image = picture([(100, 120), (250.5, 80.2)]).astype(np.float32) / 255
    orders = {(0, 2): 0, (2, 0): 1, (1, 1): 2}
    found = hessian_exact(image, sigma)
    oracle = {o: gaussian_filter(image.astype(float), sigma, order=o, mode="reflect") for o in orders}
    theirs = oracle[0, 2] * oracle[2, 0] - oracle[1, 1] ** 2
    ours = found[0].astype(float) * found[1] - found[2].astype(float) ** 2
    assert np.max(np.abs(ours - theirs)) < 0.004 * np.max(np.abs(theirs))


def test_masks_find_what_the_exact_form_finds():
    spots = [(100.3, 120.1), (250.5, 80.2), (40.0, 333.3)]
    image = picture(spots).astype(np.float32)
    image[image < 90] = 0
    for exact in (False, True):
        blobs = find_blobs(image / 255, SCALES, 0.01, exact)
        for spot in spots:
            assert np.min(np.linalg.norm(blobs.at - spot, axis=1)) < 0.5
    assert all(np.max(each) > 0 for each in determinants(image / 255, SCALES, False))


def test_the_scale_of_a_blob_is_its_size():
    rows, columns = np.mgrid[:SIZE, :SIZE]
    for k, size in enumerate(SCALES):
        image = np.exp(-0.5 * ((columns - 200) ** 2 + (rows - 200) ** 2) / size**2).astype(np.float32)
        blobs = find_blobs(image, SCALES, 0.01, exact=True)
        assert blobs.scale[np.argmax(blobs.strength)] == pytest.approx(SCALES[k])


@given(st.integers(0, 2**31), st.integers(1, 12), st.booleans())
@settings(max_examples=30)
def test_searching_around_echoes_finds_what_searching_everywhere_does(seed, count, exact):
    """A floor too faint to count, but not 0, makes one box of the whole picture. Equal neighbours may be told apart
    otherwise: places are compared to a pixel.
    """
    rng = np.random.default_rng(seed)
    image = np.zeros((330, 410), dtype=np.float32)
    for x, y in rng.uniform([-5, -5], [415, 335], (count, 2)).astype(int).tolist():
        axes, angle, grey = (int(rng.integers(1, 12)), 2), float(rng.uniform(0, 180)), float(rng.uniform(0.4, 1))
        cv2.ellipse(image, (x, y), axes, angle, 0, 360, grey, -1)
    found = find_blobs(image, SCALES, 0.01, exact)
    whole = find_blobs(np.maximum(image, np.float32(1e-30)), SCALES, 0.01, exact)
    apart = np.linalg.norm(found.at[:, None] - whole.at, axis=-1)
    assert (len(found.at) == 0) == (len(whole.at) == 0)
    assert all(np.max(np.min(each, axis=1)) < 1.0 for each in (apart, apart.T) if each.size)


def test_most_of_a_dark_picture_is_not_searched():
    image = np.zeros((640, 640), dtype=np.float32)
    image[[100, 130, 500], [200, 210, 639]] = 1.0
    boxes, owner = surroundings(image, 30.0)
    assert len(boxes) == 2  # the first two are near one another
    assert [number for number in np.unique(owner) if number] == [1, 2]
    for (row, column), box in zip(((100, 200), (500, 639)), boxes, strict=True):
        rows, columns = box
        assert owner[row // BLOCK, column // BLOCK] > 0
        assert rows.start <= row - 30 < row + 30 < rows.stop
        assert columns.start <= column - 30
        assert columns.stop == 640 or column + 30 < columns.stop
    assert len(surroundings(np.ones((640, 640), dtype=np.float32), 30.0)[0]) == 1
    assert surroundings(np.zeros((640, 640), dtype=np.float32), 30.0)[0] == []


# Groups.


@given(st.integers(1, 40), st.floats(1, 60), st.integers(0, 2**31))
@settings(max_examples=40)
def test_linked_groups_are_single_link(k, distance, seed):
    from scipy.cluster.hierarchy import fcluster, linkage

    points = np.random.default_rng(seed).uniform(0, 300, (k, 2))
    labels = linked(points, distance)
    if k > 1:
        oracle = fcluster(linkage(points, "single"), distance, "distance")
        same = labels[:, None] == labels
        assert np.array_equal(same, oracle[:, None] == oracle)


def test_the_index_and_k_means_are_as_in_the_books():
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.normal(c, 5.0, (12, 2)) for c in ((0, 0), (60, 10), (20, 70))])
    labels, centres = k_means(points, np.ones(36), 3)
    for j in range(3):
        np.testing.assert_allclose(centres[j], points[labels == j].mean(axis=0), atol=1e-9)
    assert len({tuple(labels[i : i + 12]) for i in (0, 12, 24)}) == 3
    middle = points.mean(axis=0)
    between = sum(12 * np.sum((points[labels == j].mean(axis=0) - middle) ** 2) for j in range(3))
    within = sum(np.sum((points[labels == j] - points[labels == j].mean(axis=0)) ** 2) for j in range(3))
    assert calinski_harabasz(points, np.ones(36), labels, centres) == pytest.approx(between / 2 / (within / 33))
    two = calinski_harabasz(points, np.ones(36), *k_means(points, np.ones(36), 2))
    assert two < calinski_harabasz(points, np.ones(36), labels, centres)


def test_two_ships_side_by_side_are_split_and_one_ship_is_not():
    along = np.linspace(-80, 80, 9)
    one = np.stack([along, 0 * along], axis=-1)
    assert grouped(one, np.ones(9), 30.0, 180.0).max() == 0
    bow_to_stern = np.concatenate([one, one + [185.0, 0]])
    labels = grouped(bow_to_stern, np.ones(18), 30.0, 180.0)
    assert labels.max() == 1
    assert len(set(labels[:9])) == len(set(labels[9:])) == 1
    two_boats = np.array([[0.0, 0], [17, 17], [36, 36]])  # and what they look like from afar, between them
    labels = grouped(two_boats, np.ones(3), 30.0, 40.0)
    assert labels[0] != labels[2]
    assert grouped(two_boats, np.ones(3), 30.0, 60.0).max() == 0
    assert grouped(np.zeros((0, 2)), np.zeros(0), 30.0, 180.0).shape == (0,)


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
    with pytest.raises(InputError, match="is of 400 x 400 px, the picture has 300 x 300"):
        returns(picture([], size=300))
    with pytest.raises(InputError, match="must be 8 bit"):
        returns(picture(SPOTS).astype(np.uint16))
    with pytest.raises(InputError, match="geometry of a picture: metres_per_pixel"):
        returns(picture(SPOTS), metres_per_pixel=-1)
    with pytest.raises(ValueError, match="scales: must rise"):
        Chain(scales=[3.0, 2.0])
