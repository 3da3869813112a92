"""Recorded clips, where they are there; the video source and what it refuses; patches and figures in pixels."""

import json

import cv2
import numpy as np
import pytest
from scipy import ndimage

import vedette
from support.paths import EXAMPLES, recording
from vedette import ConfigError, InputError, Scan, ScanRefused, Track, Trajectory
from vedette.cli import main
from vedette_files import Apart
from vedette_flir.annotation import _enlarged
from vedette_flir.patches import alike, blurred, centroid, isolated, mask_of, median, peak, sample, similarity, without_large
from vedette_flir.sources.boxes import centred
from vedette_flir.sources.images import grey_of, look_through
from vedette_flir.sources.video import BOX
from vedette_report.pixels import pixel_figures

EXAMPLE = EXAMPLES / "flir_clip.toml"


def errors(path, *overrides):
    """Centre errors (s,) in px, the longer sides of the true boxes (s,), of one segment."""
    result = vedette.load(EXAMPLE, overrides=[f"source.path={path}", *overrides]).run()
    assert not result.refused
    track, truth = result.tracks[0], result.recording.truth[0]
    true = np.array([truth.at(time) for time in track.times])
    return np.hypot(*(track.mean[:, :2] - true[:, :2]).T), true[:, 2:].max(axis=1)


@pytest.mark.nightly("twenty segments, twice: 18 s")
@pytest.mark.parametrize("negative", [False, True])
def test_recorded_segments(negative):
    folder = recording("ir_clips")
    rows = [row.split(",")[0] for row in (folder / "segments.csv").read_text().split()[1:]]
    found = [
        errors(folder / f"{clip}.mp4", f"source.segment={rows[:i].count(clip)}", f"source.negative={str(negative).lower()}")
        for i, clip in enumerate(rows)
    ]
    every = np.concatenate([error for error, _ in found])
    lost = sum(bool(np.all((error > np.maximum(10.0, box))[-10:])) for error, box in found)
    assert np.mean(every <= 10.0) >= 0.994
    assert lost == 0
    assert np.median(every) <= 1.04
    assert np.percentile(every, 90) <= 3.0


def hot_disc(frames=20, size=(60, 80), depth=np.uint8, top=180):
    """A disc of 8 px that moves 1.5 px a frame before a slope, and its true boxes."""
    y, x = np.mgrid[: size[0], : size[1]]
    noise = np.random.default_rng(0)
    images, boxes = [], []
    for k in range(frames):
        at = np.array([15 + 1.5 * k, 30 + 0.5 * k])
        disc = (x - at[0]) ** 2 + (y - at[1]) ** 2 <= 16
        images.append((np.where(disc, top, 40 + 0.4 * x) + noise.normal(0, 1.5, size)).astype(depth))
        boxes.append([at[0] - 4 + 1, at[1] - 4 + 1, 9, 9])
    return images, np.array(boxes)


def folder_of(path, images, boxes=None):
    path.mkdir()
    for k, image in enumerate(images):
        cv2.imwrite(str(path / f"{k:04d}.png"), image)
    if boxes is not None:
        rows = [f"{k},{','.join(f'{value:g}' for value in box)}" for k, box in enumerate(boxes)]
        (path.parent / f"{path.name}_truth.csv").write_text("\n".join(["frame,x,y,w,h", *rows]))
    return path


@pytest.mark.parametrize(("depth", "top"), [(np.uint8, 180), (np.uint16, 9000)])
def test_a_folder_of_images(tmp_path, depth, top):
    error, _ = errors(folder_of(tmp_path / "disc", *hot_disc(depth=depth, top=top)))
    assert error.max() < 1.5


@pytest.mark.costly
def test_the_command_leaves_figures_a_track_and_pictures(tmp_path, capsys):
    path = folder_of(tmp_path / "disc", *hot_disc())
    assert main(["run", str(EXAMPLE), "--set", f"source.path={path}", "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["within_10px"] == 1.0
    assert found["lost"] == 0.0
    assert found["centre_error_median_px"] <= found["centre_error_p90_px"] < 1.5
    assert found["ms_per_frame"] > 0
    assert f"overlap            {found['overlap']:.3g}: " in (tmp_path / "out" / "summary.txt").read_text()
    rows = (tmp_path / "out" / "tracks.csv").read_text().splitlines()
    assert len(rows) == 21
    assert (tmp_path / "out" / "strip.png").stat().st_size > 10_000


def test_a_box_stands_in_for_truth(tmp_path):
    images, boxes = hot_disc()
    path = folder_of(tmp_path / "disc", images)
    result = vedette.load(EXAMPLE, overrides=[f"source.path={path}", f"source.box={boxes[0].tolist()}"]).run()
    last = centred(boxes[-1], 1.0)
    assert np.hypot(*(result.tracks[0].mean[-1, :2] - last[:2])) < 1.5
    with pytest.raises(ConfigError, match=r"source\.box: is missing"):
        vedette.load(EXAMPLE, overrides=[f"source.path={path}"]).run()
    with pytest.raises(ConfigError, match=r"source\.box: must be \[x, y, w, h\] with w and h > 0"):
        vedette.load(EXAMPLE, overrides=[f"source.path={path}", "source.box=[1, 2, 0, 4]"]).run()


def test_frames_that_cannot_be_used_are_told_and_the_track_goes_on(tmp_path):
    images, boxes = hot_disc()
    images[5] = images[5][:50]
    images[7] = np.stack([images[7], images[7], np.zeros_like(images[7])], axis=-1)
    path = folder_of(tmp_path / "disc", images, boxes)
    (path / "0009.png").write_bytes(b"no image")
    result = vedette.load(EXAMPLE, overrides=[f"source.path={path}", "source.grey=equal"]).run()
    told = [str(problem) for problem in result.refused]
    assert any("frame 5: must be 80 x 60 px as the first, got 80 x 50" in text for text in told)
    assert any("frame 7: is in colour" in text for text in told)
    assert any("frame 9: 0009.png is no image" in text for text in told)
    assert len(result.tracks[0].times) == 17
    assert np.hypot(*(result.tracks[0].mean[-1, :2] - centred(boxes[-1], 1.0)[:2])) < 1.5


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ([0, 1, 2, 5, 6, 7], [("f5.png", 2)]),
        ([0, 10, 20, 40, 50, 60], [("f40.png", 1)]),
        ([0, 33, 67, 100, 133, 167], []),
    ],
)
def test_numbers_that_lack_in_a_folder_are_told(tmp_path, numbers, told):
    images, boxes = hot_disc(frames=6)
    (tmp_path / "disc").mkdir()
    for number, image in zip(numbers, images, strict=True):
        cv2.imwrite(str(tmp_path / "disc" / f"f{number}.png"), image)
    path, box = tmp_path / "disc", boxes[0].tolist()
    recording = vedette.load(EXAMPLE, overrides=[f"source.path={path}", f"source.box={box}"]).run().recording
    assert [(problem.place, problem.rows) for problem in recording.refused] == told
    assert recording.rows["frames"].total == 6 + sum(problem.rows for problem in recording.refused)


def test_a_cut_jpeg_is_told_and_not_tracked_in(tmp_path):
    """OpenCV gives the part that is there, and grey below."""
    images, boxes = hot_disc()
    path = folder_of(tmp_path / "disc", images, boxes)
    for png in sorted(path.glob("*.png")):
        cv2.imwrite(
            str(png.with_suffix(".jpg")), cv2.imread(str(png), cv2.IMREAD_UNCHANGED), [cv2.IMWRITE_JPEG_QUALITY, 100]
        )
        png.unlink()
    cut = path / "0009.jpg"
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
    result = vedette.load(EXAMPLE, overrides=[f"source.path={path}"]).run()
    assert [str(problem).startswith("frame 9: 0009.jpg is cut off") for problem in result.refused] == [True]
    assert len(result.tracks[0].times) == 19


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda path: None, "there is no such file"),
        (lambda path: path.mkdir(), "holds no image"),
        (lambda path: path.write_bytes(b"nothing"), "no video that OpenCV can read"),
    ],
)
def test_sources_that_are_none(tmp_path, make, text):
    make(tmp_path / "clip.avi")
    with pytest.raises(InputError, match=text):
        vedette.load(EXAMPLE, overrides=[f"source.path={tmp_path / 'clip.avi'}", "source.box=[1, 1, 9, 9]"]).run()


def test_a_truncated_video_gives_what_it_has(tmp_path):
    images, boxes = hot_disc(frames=40)
    whole = tmp_path / "whole.avi"
    writer = cv2.VideoWriter(str(whole), cv2.VideoWriter_fourcc(*"MJPG"), 30, (80, 60))
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    part = tmp_path / "part.avi"
    part.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    result = vedette.load(EXAMPLE, overrides=[f"source.path={part}", f"source.box={boxes[0].tolist()}"]).run()
    assert 5 < len(result.scans) < 40
    assert "promises 40 frames" in str(result.refused[0])


@pytest.mark.parametrize("apart", [None, Apart(memory=500)], ids=["here", "in a process of its own"])
def test_pages_of_a_tiff_file_are_frames(tmp_path, apart):
    pages = [np.random.default_rng(k).integers(0, 60_000, (12, 16), dtype=np.uint16) for k in range(30)]
    path = tmp_path / "clip.tif"
    cv2.imwritemulti(str(path), [*pages[:20], pages[20][:6], *pages[21:]])
    clip = look_through(path, apart=apart)
    assert clip.numbers == (*range(20), *range(21, 30))
    assert [str(problem) for problem in clip.problems] == ["frame 20: must be 16 x 12 px as the first, got 16 x 6"]
    for k in (29, 0, 19, 21, 5):
        np.testing.assert_array_equal(clip.frame(k), pages[k])


def test_a_cut_tiff_file_gives_what_it_has_and_says_so(tmp_path):
    pages = [np.full((12, 16), 10 * k, dtype=np.uint8) for k in range(20)]
    path = tmp_path / "clip.tiff"
    cv2.imwritemulti(str(path), pages)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    clip = look_through(path)
    assert 5 < len(clip.numbers) < 15
    assert "breaks off after" in str(clip.problems[-1])
    cv2.imwrite(str(tmp_path / "clip.png"), pages[0])
    for other in (b"II*\0", (tmp_path / "clip.png").read_bytes()):
        path.write_bytes(other)
        with pytest.raises(InputError, match="no TIFF file"):
            look_through(path)


def test_colour_and_depth():
    grey = np.arange(12, dtype=np.uint8).reshape(3, 4)
    np.testing.assert_array_equal(grey_of(np.stack([grey] * 3, axis=-1)), grey)
    with pytest.raises(ValueError, match="colour"):
        grey_of(np.stack([grey, grey, grey + 100], axis=-1), "equal")
    with pytest.raises(ValueError, match="8 or 16 bit"):
        grey_of(grey.astype(np.float32))
    with pytest.raises(ValueError, match=r"one channel, or three.*got 5"):
        grey_of(np.stack([grey] * 5, axis=-1))


@pytest.mark.parametrize("change", [lambda f: np.full_like(f, np.nan), np.ones_like, lambda f: np.full_like(f, 255.0)])
@pytest.mark.by_turns
def test_frames_without_a_target_are_coasted_through(tmp_path, change):
    """All pixels unknown, without contrast, or saturated: the frame is a miss, the track goes on with what it knew."""
    images, boxes = hot_disc()
    experiment = vedette.load(EXAMPLE, overrides=[f"source.path={folder_of(tmp_path / 'disc', images, boxes)}"])
    tracker, recording = experiment.tracker, experiment.run().recording
    state = tracker.start(tracker.given(recording), recording.scans[0].time)
    for scan in recording.scans[:12]:
        state = tracker.step(state, scan)
    before = tracker.estimate(state)
    blank = vedette.Frame(change(recording.scans[12].frame.pixels.astype(float)))
    after = tracker.step(state, Scan.image(recording.scans[12].time, "camera", blank))
    assert after.hit[0] < 0.2
    assert np.hypot(*(tracker.estimate(after).mean[0, :2] - before.mean[0, :2])) < 5.0
    assert tracker.estimate(after).cov[0, 0, 0] > before.cov[0, 0, 0]
    state = tracker.step(after, recording.scans[13])
    assert state.hit[0] > 0.9
    assert np.hypot(*(tracker.estimate(state).mean[0, :2] - centred(boxes[13], 1.0)[:2])) < 1.5


def test_a_scan_without_a_frame_and_a_frame_for_no_camera_are_refused():
    tracker = vedette.load(EXAMPLE).tracker
    n = len(tracker.state)
    state = tracker.start(vedette.Gaussian(np.zeros((0, n)), np.zeros((0, n, n))))
    with pytest.raises(ScanRefused, match="frame: must hold a frame"):
        tracker.step(state, Scan(0.0, "camera", vedette.Detections.of([], 2)))
    with pytest.raises(ScanRefused, match="pixels must have shape"):
        tracker.step(state, Scan.image(0.0, "camera", vedette.Frame(np.zeros(4))))


def test_patches():
    rng = np.random.default_rng(2)
    pixels = rng.normal(size=(40, 50))
    np.testing.assert_allclose(sample(pixels, np.array([20.5, 17.5]), 1.0, 6), pixels[15:21, 18:24], atol=1e-12)
    slope = np.add.outer(2.0 * np.arange(40), 3.0 * np.arange(50))
    found = sample(slope, np.array([20.25, 16.75]), 2.5, 4)
    offsets = 2.5 * (np.arange(4) - 1.5)
    np.testing.assert_allclose(found, 2.0 * (16.75 + offsets)[:, None] + 3.0 * (20.25 + offsets), atol=1e-9)
    image, mask = rng.normal(size=(20, 20)), mask_of(np.array([6.0, 4.0]), 8)
    patch = 3.0 * image[5:13, 7:15] + 2.0
    likeness, same = similarity(image, np.stack([patch, image[5:13, 7:15] + 2.0]), mask)
    window = image[2:10, 3:11]
    centred_patch, centred_window = (a - np.sum(mask * a) / mask.sum() for a in (patch, window))
    parts = np.sum(mask * centred_patch**2) + np.sum(mask * centred_window**2)
    assert likeness[2, 3] == pytest.approx(2 * np.sum(mask * centred_patch * centred_window) / parts, abs=1e-9)
    assert alike(window, patch, mask) == pytest.approx(likeness[2, 3], abs=1e-12)
    assert alike(patch, np.ones((8, 8)), mask) == pytest.approx(0.0, abs=1e-12)
    for values in (image, image[:19, :19]):
        assert median(values) == np.median(values)
    smooth = ndimage.correlate1d(
        ndimage.correlate1d(image, [0.25, 0.5, 0.25], 0, mode="nearest"), [0.25, 0.5, 0.25], 1, mode="nearest"
    )
    np.testing.assert_allclose(blurred(image), smooth, atol=1e-12)
    assert likeness[5, 7] == pytest.approx(2 * 3 / (1 + 9), abs=1e-9)  # the same shape, three times as strong
    assert same[5, 7] == pytest.approx(1.0, abs=1e-9)
    assert peak(likeness)[:2] == (5, 7)


def test_what_is_brighter_and_longer_than_a_target_is_taken_out_near_it():
    scene = np.zeros((40, 60))
    scene[25:29] = 90.0  # a bank
    scene[10:13, 28:32] = 90.0  # short
    scene[18:20, 5:50] = 20.0  # long, and no brighter
    scene[35:38, 28:32] = 20.0  # a target
    expected = scene.copy()
    expected[25:29, 20:40] = 0.0
    np.testing.assert_array_equal(without_large(scene, 30.0, 8.0, 10.0), expected)
    expected[25:29] = 0.0
    expected[18:20, 5:50] = 20.0
    np.testing.assert_array_equal(without_large(scene, 30.0, 8.0, 60.0), expected)
    assert without_large(scene, np.inf, 8.0, 60.0) is scene
    shaded = scene + np.where(np.abs(np.arange(40) - 26.5) < 4, 5.0, 0.0)[:, None]
    assert (without_large(shaded, 30.0, 8.0, 60.0)[23:31] == 0.0).all()  # and its halo


def test_what_is_larger_than_the_target_is_taken_out():
    scene = np.zeros((24, 24))
    scene[14:] = 90.0  # trees
    scene[5:8, 10:13] = 20.0  # a bird
    expected = np.where(scene == 20.0, 20.0, 0.0)
    np.testing.assert_allclose(isolated(scene + 7.0, 6.0), expected)
    assert isolated(scene, 30.0).max() > 80.0  # with too wide an opening the trees would stand out
    np.testing.assert_allclose(centroid(expected), [-0.5, -5.5])
    np.testing.assert_array_equal(centroid(np.zeros((5, 5))), [0.0, 0.0])


def test_pixel_figures():
    times = np.arange(20.0)
    true = np.column_stack([times, times, np.full((20, 2), 30.0)])
    off = np.where(times < 5, 1.0, 29.0)
    mean = true + np.column_stack([off, np.zeros((20, 3))])
    nothing = np.zeros(20)
    track = Track(0, BOX, times, mean, np.zeros((20, 4, 4)), nothing == 0, nothing, None, (), nothing, nothing)
    truth = Trajectory("t", BOX, times, true)
    figures = pixel_figures([track], [truth])
    errors = {"within_10px": 0.25, "centre_error_median_px": 29.0, "centre_error_p90_px": 29.0, "lost": 0.0}
    assert figures == errors | {"overlap": pytest.approx((5 * 29 / 31 + 15 * 1 / 59) / 20)}
    small = Trajectory("t", BOX, times, np.column_stack([true[:, :2], np.full((20, 2), 20.0)]))
    assert pixel_figures([track], [small])["lost"] == 1.0
    assert pixel_figures([], [truth]) == {}


@pytest.mark.parametrize(("shape", "side"), [((256, 320), 120), ((1024, 1280), 320), ((2160, 3840), 720)])
def test_a_small_target_is_enlarged_by_what_the_frame_has_room_for(shape, side):
    assert _enlarged(np.zeros((*shape, 3), np.uint8), 1, np.array([50.0, 60.0])).shape == (side, side, 3)


@pytest.mark.costly
def test_a_run_leaves_an_annotated_video_and_speaks_of_px(tmp_path, capsys):
    path = folder_of(tmp_path / "disc", *hot_disc())
    assert main(["run", str(EXAMPLE), "--set", f"source.path={path}", "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "annotated.avi" in told
    assert "a track within 10 px covers an object" in told
    assert "RMSE [px]" in told
    assert " m RMSE" not in told
    video = cv2.VideoCapture(str(tmp_path / "out" / "annotated.avi"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 20
    read, image = video.read()
    assert read
    assert image.shape == (240, 320, 3)  # 80 x 60 enlarged four times
    at = 4 * (centred(hot_disc()[1][0], 1.0)[:2] + 0.5)
    x, y = at.astype(int)
    apart = image[..., 2].astype(int) - image[..., 0]
    assert np.max(apart[y, x + 18 : x + 28]) > 60  # a side of the orange box, 9 px wide and a pixel off
    assert np.max(np.abs(apart[y - 12 : y + 13, x - 12 : x + 13])) < 30  # the target is not covered
    assert [file.name for file in (tmp_path / "out").iterdir() if file.name.startswith(".")] == []
