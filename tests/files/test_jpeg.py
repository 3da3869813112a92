"""A JPEG is whole or its fault is told; OpenCV fills what is cut off with grey and says nothing."""

import numpy as np
import pytest

from vedette_files.images.jpeg import check_jpeg, is_jpeg

cv2 = pytest.importorskip("cv2")
PICTURE = np.random.default_rng(0).integers(0, 255, (40, 60), dtype=np.uint8)


@pytest.fixture(params=["baseline", "progressive"])
def whole(request, tmp_path):
    path = tmp_path / "a.jpg"
    assert cv2.imwrite(str(path), PICTURE, [cv2.IMWRITE_JPEG_PROGRESSIVE, int(request.param == "progressive")])
    return path


def test_a_whole_one_passes(whole):
    assert is_jpeg(whole)
    check_jpeg(whole)
    whole.write_bytes(whole.read_bytes() + bytes(100))  # as some cameras pad
    check_jpeg(whole)


@pytest.mark.parametrize("kept", [3, 10, 100, 0.3, 0.6, 0.99])
def test_a_cut_one_is_told(whole, kept):
    data = whole.read_bytes()
    whole.write_bytes(data[: kept if isinstance(kept, int) else int(kept * len(data))])
    with pytest.raises(ValueError, match=r"cut off|corrupted"):
        check_jpeg(whole)


def test_the_end_of_a_thumbnail_is_not_that_of_the_picture(whole):
    """A segment before the pixels may hold a picture of its own, with an end."""
    data = whole.read_bytes()
    thumbnail = b"\xff\xd8 small \xff\xd9"
    segment = b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail
    whole.write_bytes(data[:2] + segment + data[2 : len(data) // 2])
    with pytest.raises(ValueError, match="cut off"):
        check_jpeg(whole)
