"""What `benchmarks.flir_found` draws is what it says; its operating curve is one: more is found where more stands out."""

from __future__ import annotations

import numpy as np
import pytest

import vedette
from benchmarks import flir_clips as clips
from benchmarks import flir_found as found


@pytest.mark.costly
def test_a_drawn_spot_is_found_and_noise_is_not() -> None:
    made = vedette.load(found.EXAMPLE, overrides=["preprocessors.spots.clear=5"])
    shares = [found.found_drawn(made, snr, 1) for snr in (1.0, 12.0)]
    assert shares == [0.0, 1.0]
    assert not found.tracked([found.drawn(0.0, k, 0)[0] for k in range(40)], made)


@pytest.mark.nightly("the operating curve of tracks, ten runs a point: 60 s")
def test_more_is_found_where_more_stands_out_and_where_less_is_asked() -> None:
    shares = np.array(
        [
            [
                found.found_drawn(vedette.load(found.EXAMPLE, overrides=[f"preprocessors.spots.clear={clear}"]), snr, 10)
                for snr in (4.0, 6.0, 8.0)
            ]
            for clear in (5.0, 8.0)
        ]
    )
    two_errors = 2.0 * np.sqrt(0.25 / 10)
    assert (np.diff(shares, axis=1) >= -two_errors).all()
    assert (np.diff(shares, axis=0) <= two_errors).all()
    assert shares[0, -1] >= 1.0 - two_errors


def test_a_still_over_which_a_camera_turns_has_no_target() -> None:
    y, x = np.mgrid[:256, :320]
    still = 90.0 + 20.0 * np.sin(x / 25.0) * np.cos(y / 19.0) + 150.0 * np.exp(-((x - 150) ** 2 + (y - 120) ** 2) / 18.0)
    clip = clips.Clip("drawn", still[None], {0: np.array([150.0, 120.0, 14.0, 14.0])}, ((0, 1),))
    frames = found.turning(clip, np.random.default_rng(1), 60)
    assert {frame.shape for frame in frames} == {found.WINDOW[::-1]}
    assert max(frame.max() for frame in frames) < 130.0
    assert np.abs(frames[-1] - frames[0]).mean() > 5.0


@pytest.mark.parametrize(
    ("contrast", "edge", "seen"), [(12.0, 99, True), (0.0, 99, False), (25.0, 26, True), (1.0, 26, False)]
)
def test_a_frame_shows_its_target_by_its_label_alone(contrast: float, edge: int, seen: bool) -> None:
    """Also near a treeline; a target that a codec has erased is not shown."""
    y, x = np.mgrid[:50, :60]
    sky = 60.0 + np.random.default_rng(4).normal(0.0, 1.5, y.shape) + 60.0 * (y > edge)
    spot = contrast * np.exp(-((x - 30.0) ** 2 + (y - 20.0) ** 2) / 8.0)
    assert clips.is_seen(sky + spot, np.array([30.0, 20.0, 9.0, 9.0])) == seen
