"""Blobs and clusters of a radar picture against exact forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.spots import picture
from vedette_marine.picture.blobs import BLOCK, determinants, find_blobs, hessian_exact, surroundings
from vedette_standard.grouping import calinski_harabasz, grouped, k_means, linked

cv2 = pytest.importorskip("cv2")
SIZE = 400
SCALES = (1.5, 2.1, 3.0, 4.2, 6.0)


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


@pytest.mark.costly
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
