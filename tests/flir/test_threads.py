"""Trackers of video in several threads leave OpenCV with as many threads of its own as it had."""

from itertools import permutations

import cv2
import pytest

from vedette_flir.sources.images import one_thread


@pytest.fixture
def three():
    """Let OpenCV have three threads, and as many as before in the end."""
    usual = cv2.getNumThreads()
    cv2.setNumThreads(3)
    yield
    cv2.setNumThreads(usual)


@pytest.mark.usefixtures("three")
@pytest.mark.parametrize("ends", list(permutations(range(3))))
def test_it_has_one_thread_until_the_last_of_all_has_ended(ends):
    """As threads of Python do, three begin and end in any order: the last to end left OpenCV with one for ever."""
    blocks = [one_thread() for _ in ends]
    for block in blocks:
        assert block.__enter__().getNumThreads() == 1
    for end in ends[:-1]:
        blocks[end].__exit__(None, None, None)
        assert cv2.getNumThreads() == 1
    blocks[ends[-1]].__exit__(None, None, None)
    assert cv2.getNumThreads() == 3
