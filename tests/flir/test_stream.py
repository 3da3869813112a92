"""Frames that come once: a file of any length, a URL, a camera."""

import gc
import sys
import tracemalloc

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError, InputError, LazyScans, Scan
from vedette.cli import main
from vedette_report.progress import on_terminal
from vedette_report.running.streaming import stream

EXAMPLE = EXAMPLES / "flir_clip.toml"
BOX = [11, 26, 9, 9]


def picture(k):
    """A frame of 60 x 80 px with a disc that moves 1 px to the right, and turns back each 50 frames."""
    y, x = np.mgrid[:60, :80]
    at = 15 + abs((k + 50) % 100 - 50)
    disc = (x - at) ** 2 + (y - 30) ** 2 <= 16
    return (np.where(disc, 180, 40) + np.random.default_rng(k).normal(0, 1.5, x.shape)).astype(np.uint8), at


class Camera:
    """A capture as OpenCV's, of frames that are drawn as they are read."""

    def __init__(self, address, frames=30, change=None):
        self.address, self.left, self.at, self.change, self.released = address, frames, 0, change or {}, False

    def isOpened(self):  # OpenCV's name
        return True

    def get(self, what):
        return {cv2.CAP_PROP_FPS: 0.0, cv2.CAP_PROP_FRAME_WIDTH: 80.0, cv2.CAP_PROP_FRAME_HEIGHT: 60.0}[what]

    def read(self):
        if self.at >= self.left:
            return False, None
        self.at += 1
        image = self.change.get(self.at - 1, picture(self.at - 1)[0])
        return True, image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)

    def release(self):
        self.released = True


@pytest.fixture
def camera(monkeypatch):
    """Return a function that puts a camera of some frames in the place of OpenCV's; it says which was opened."""
    opened = []

    def put(frames=30, change=None):
        monkeypatch.setattr(cv2, "VideoCapture", lambda at: opened.append(Camera(at, frames, change)) or opened[-1])
        return opened

    return put


@pytest.fixture
def clip(tmp_path):
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25, (80, 60))
    for k in range(30):
        writer.write(cv2.cvtColor(picture(k)[0], cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def experiment(address, *overrides):
    given = {"kind": "video_stream", "address": str(address), "box": BOX}
    lines = [f'source={{kind = "video_stream", address = "{given["address"]}", box = {BOX}}}', *overrides]
    return vedette.load(EXAMPLE, overrides=lines)


def end_of(result):
    return result.tracks[0].mean[-1, :2]


@pytest.mark.parametrize("as_url", [True, False])
@pytest.mark.by_turns
def test_a_file_or_its_url_is_followed_to_its_end(clip, as_url):
    result = experiment(clip.as_uri() if as_url else clip).run()
    assert len(result.scans) == 30
    np.testing.assert_allclose(end_of(result), [picture(29)[1], 30], atol=1.5)
    assert result.scans[-1].time == pytest.approx(29 / 25)
    whole = vedette.load(EXAMPLE, overrides=[f"source.path={clip}", f"source.box={BOX}"]).run()
    np.testing.assert_array_equal(result.tracks[0].mean, whole.tracks[0].mean)


def test_a_camera_is_opened_by_its_number_and_read_as_its_frames_are_asked_for(camera):
    opened = camera(frames=200)
    steps = experiment("3").steps()
    assert opened[0].address == 3
    assert opened[0].at == 1
    for k, (scan, _) in enumerate(steps):
        assert opened[0].at == k + 1
        assert scan.time == pytest.approx(k / 30)
        if k == 20:
            break


def test_the_run_ends_after_the_frames_asked_for_and_the_camera_is_let_go_where_it_ends(camera):
    opened = camera(frames=12)
    assert len(experiment("0", "source.frames=7").run().scans) == 7
    assert len(experiment("0").run().scans) == 12
    assert [each.released for each in opened] == [False, True]


def test_times_of_arrival_are_kept(camera, monkeypatch):
    ticks = iter(np.cumsum([5.0, *np.arange(1, 31) / 10.0]))
    monkeypatch.setattr("vedette_flir.sources.stream.monotonic", lambda: float(next(ticks)))
    camera()
    times = [scan.time for scan in experiment("0", "source.clock=arrival").run().scans]
    np.testing.assert_allclose(times, np.cumsum([0.0, *np.arange(1, 30) / 10.0]))


def test_frames_come_once(camera):
    camera()
    scans = experiment("0").steps().recording.scans
    assert isinstance(scans, LazyScans)
    assert isinstance(scans[0], Scan)
    assert scans[4].time == pytest.approx(4 / 30)
    with pytest.raises(InputError, match="frame 2 of a stream was read"):
        scans[2]


def test_a_frame_that_cannot_be_used_is_told_and_the_track_goes_on(camera):
    coloured = np.stack([picture(11)[0], picture(11)[0], np.zeros((60, 80), np.uint8)], axis=-1)
    camera(change={9: picture(9)[0][:50], 11: coloured})
    with pytest.warns(RuntimeWarning) as told:
        result = experiment("0", "source.grey=equal").run()
    words = [str(each.message) for each in told if "unknown" in str(each.message)]
    assert words[0] == "frame 9: must be 80 x 60 px, uint8, got 80 x 50, uint8; its pixels count as unknown"
    assert words[1].startswith("frame 11: is in colour")
    np.testing.assert_allclose(end_of(result), [picture(29)[1], 30], atol=1.5)


@pytest.mark.parametrize(
    ("address", "overrides", "error", "told"),
    [
        ("", [], ConfigError, r"source\.address: is missing"),
        ("nowhere.avi", [], InputError, "there is no such file"),
        ("file:///nowhere.avi", [], InputError, "is no camera, stream"),
        ("{clip}", ["source.box=[500, 1, 9, 9]"], ConfigError, r"source\.box: must lie in the image.*60"),
        ("{clip}", ["source.box=[5, 1, 9]"], ConfigError, r"source\.box: must be \[x, y, w, h\], got 3 numbers"),
    ],
)
def test_what_cannot_be_opened(clip, address, overrides, error, told):
    with pytest.raises(error, match=told):
        experiment(address.format(clip=clip), *overrides).run()


def test_a_stream_without_frames_and_one_in_colour(camera):
    camera(frames=0)
    with pytest.raises(InputError, match="gives no frame"):
        experiment("0").run()
    camera(change={0: np.stack([picture(0)[0], picture(0)[0], np.zeros((60, 80), np.uint8)], axis=-1)})
    with pytest.raises(InputError, match=r"frame 0"):
        experiment("0", "source.grey=equal").run()


@pytest.mark.costly
def test_a_command_writes_the_track_as_it_goes(clip, tmp_path, capsys):
    out = tmp_path / "out"
    sets = ["--set", f'source={{kind = "video_stream", address = "{clip}", box = {BOX}}}']
    assert main(["run", str(EXAMPLE), "--out", str(out), *sets]) == 0
    assert len((out / "tracks.csv").read_text().splitlines()) == 31
    assert not (out / "recording_frames").exists()
    assert main(["run", str(EXAMPLE), "--out", str(tmp_path / "some"), *sets, "--set", "source.frames=20"]) == 0
    assert (tmp_path / "some" / "picture.png").exists()
    capsys.readouterr()


def test_a_bar_promises_no_end_of_a_stream(camera, monkeypatch):
    bars = pytest.importorskip("rich.progress").Progress
    totals, add = [], bars.add_task

    def noted(bar, *args, **given):
        totals.append(given["total"])
        return add(bar, *args, **given)

    camera()
    monkeypatch.setattr(bars, "add_task", noted)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    scans = experiment("0").steps().recording.scans
    with on_terminal() as progress:
        assert len(list(progress(scans, "tracking"))) == 30
        assert len(list(progress([1, 2], "others"))) == 2
    assert totals == [None, 2]


@pytest.mark.costly
def test_memory_does_not_grow_with_a_stream(camera, tmp_path, pytestconfig, monkeypatch):
    """Half as many frames leave as much: what is held after 100 (nightly 6,000) is that after half of them.

    The series wait in blocks of some MB, however long the run: here in small ones, so that they hide nothing.
    """
    monkeypatch.setattr("vedette_files.series._BLOCK", 2**16)
    many = 6_000 if pytestconfig.getoption("vedette_profile") == "nightly" else 100
    held = []

    class Endless(Camera):
        def read(self):
            if self.at in (many // 2, many - 1):
                gc.collect()
                held.append(tracemalloc.get_traced_memory()[0])
            return super().read()

    opened = camera(frames=many)
    one = experiment("0")
    cv2.VideoCapture = lambda at: opened.append(Endless(at, many)) or opened[-1]  # monkeypatch undoes it
    tracemalloc.start()
    stream(one, tmp_path / "out")
    tracemalloc.stop()
    assert held[1] - held[0] < 100 * 60 * 80
