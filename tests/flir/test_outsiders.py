"""What an outsider gives a video by mistake: each ends in a right result, or in an error that says where and what."""

import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError, Frame, Gaussian, InputError, Scan, ScanRefused
from vedette_flir.sources.stored import in_order
from vedette_report.pixels import pixel_figures
from vedette_tools.drafting.config import draft_config

EXAMPLE = EXAMPLES / "flir_clip.toml"


def spot(folder, frames=12, name="f{:03d}.png"):
    """A disc that goes right by 2 px a frame, as images in a folder; its boxes as rows of frame, x, y, w, h."""
    folder.mkdir()
    y, x = np.mgrid[:60, :80]
    noise, rows = np.random.default_rng(0), []
    for k in range(frames):
        image = 60 + 120.0 * ((x - 20 - 2 * k) ** 2 + (y - 30) ** 2 <= 9) + noise.normal(0, 1.5, x.shape)
        cv2.imwrite(str(folder / name.format(k)), image.astype(np.uint8))
        rows.append((k, 18 + 2 * k, 28, 7, 7))
    return folder, rows


def written(folder, rows):
    path = folder.parent / f"{folder.name}_truth.csv"
    path.write_text("frame,x,y,w,h\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return folder


def run(path, *overrides):
    return vedette.load(EXAMPLE, overrides=[f"source.path={path}", *overrides]).run()


def test_images_are_taken_in_the_order_of_their_numbers(tmp_path):
    folder, _ = spot(tmp_path / "clip", name="f{}.png")
    track = run(folder, "source.box=[18, 28, 7, 7]").tracks[0]
    assert np.max(np.abs(track.mean[:, 0] - (20 + 2 * np.arange(12)))) < 1
    assert [
        file.name for file in sorted([Path("f10.png"), Path("f9.png"), Path("e11.png"), Path("f09.png")], key=in_order)
    ] == [
        "e11.png",
        "f09.png",
        "f9.png",
        "f10.png",
    ]


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ((5, "nan", "nan", "nan", "nan"), r"clip_truth\.csv, line 7: must be .* got \[nan.*leave"),
        ((5, 28, 28, -7, 7), r"clip_truth\.csv, line 7: must be \[x, y, w, h\] with w and h > 0"),
        ((5, 0, 0, 0, 0), r"clip_truth\.csv, line 7: .*where the target is not"),
        (
            (4, 28, 28, 7, 7),
            r"clip_truth\.csv, line 7: frame 4 has a box already: .*line 6",
        ),
    ],
)
def test_a_wrong_row_of_true_boxes_is_named(tmp_path, wrong, told):
    folder, rows = spot(tmp_path / "clip")
    with pytest.raises(InputError, match=told):
        run(written(folder, [*rows[:5], wrong, *rows[6:]]))


def test_true_boxes_outside_the_image_and_of_no_frame_are_told(tmp_path):
    folder, rows = spot(tmp_path / "clip")
    recording = run(written(folder, [*rows[:5], (5, 500, 20, 7, 7), *rows[6:], (40, 1, 1, 7, 7)])).recording
    assert [str(problem) for problem in recording.refused] == ["box of frame 5: is outside the image of 80 x 60 px"]
    account = recording.rows["true boxes"]
    assert (account.total, account.used, account.refused, account.left_out) == (13, 11, 1, 1)
    assert len(recording.truth[0].times) == 11


def test_true_boxes_of_a_larger_image_are_an_error(tmp_path):
    folder, rows = spot(tmp_path / "clip")
    with pytest.raises(InputError, match=r"all 12 true boxes are outside.*60"):
        run(written(folder, [(k, 10 * x, 10 * y, w, h) for k, x, y, w, h in rows]))


def test_a_box_beside_true_boxes_is_judged_by_them(tmp_path):
    folder, rows = spot(tmp_path / "clip")
    result = run(written(folder, rows), "source.box=[17, 29, 7, 7]")
    assert len(result.recording.truth[0].times) == 12
    assert result.score().coverage == 1.0
    np.testing.assert_array_equal(result.tracks[0].mean[0, :2], [19, 31])


def test_a_target_that_is_away_for_a_while_is_not_judged_meanwhile(tmp_path):
    folder, rows = spot(tmp_path / "clip")
    gone = [(k, *("",) * 4) if 4 <= k < 8 else row for k, row in enumerate(rows)]
    recording = run(written(folder, gone)).recording
    assert [(path.name, len(path.times)) for path in recording.truth] == [("target 1", 4), ("target 2", 4)]
    assert [sum(path.at(scan.time) is not None for path in recording.truth) for scan in recording.scans] == [
        *([1] * 4 + [0] * 4 + [1] * 4)
    ]
    sparse = run(written(folder, [row for row in rows if row[0] % 4 != 2])).recording
    assert [(path.name, len(path.times)) for path in sparse.truth] == [("target", 9)]


def test_figures_in_px_are_those_of_the_frames_in_which_the_target_is_there(tmp_path):
    folder, rows = spot(tmp_path / "clip")
    gone = [(k, *("",) * 4) if 4 <= k < 8 else row for k, row in enumerate(rows)]
    result = run(written(folder, gone))
    parts = [
        np.hypot(*(result.tracks[0].mean[part, :2] - [[20 + 2 * k, 30] for k in part]).T)
        for part in (range(4), range(8, 12))
    ]
    figures = pixel_figures(result.tracks, result.recording.truth)
    assert figures["centre_error_median_px"] == pytest.approx(np.median(np.concatenate(parts)), abs=1e-9)
    assert pixel_figures(result.tracks, result.recording.truth[:1] * 2) == {}


def test_opacity_is_left_out(tmp_path):
    folder, _ = spot(tmp_path / "clip")
    plain = run(folder, "source.box=[18, 28, 7, 7]").tracks[0].mean
    for file in folder.iterdir():
        grey = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        opacity = np.random.default_rng(0).integers(0, 256, grey.shape, np.uint8)
        cv2.imwrite(str(file), np.dstack([grey, grey, grey, opacity]))
    np.testing.assert_array_equal(run(folder, "source.box=[18, 28, 7, 7]").tracks[0].mean, plain)


@pytest.mark.parametrize("box", ["[0.3, 0.4, 0.1, 0.1]", "[20, 20, 0.5, 7]", "[-10, -10, 90, 7]", "[-9, -19, 70, 90]"])
def test_a_box_of_no_pixel_or_larger_than_the_image_is_an_error(tmp_path, box):
    folder, _ = spot(tmp_path / "clip", frames=2)
    with pytest.raises(ConfigError, match=r"source\.box: must have sides of 1 px.*60"):
        run(folder, f"source.box={box}", "source.first_pixel=0")


def stream(address):
    source = f'source={{kind="video_stream", address="{address}", box=[1, 1, 7, 7], grey="equal"}}'
    return vedette.load(EXAMPLE, overrides=[source]).run()


def test_an_error_of_a_stream_names_it(tmp_path):
    file = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), 25, (80, 60))
    writer.write(np.stack([np.full((60, 80), level, np.uint8) for level in (10, 200, 90)], axis=-1))
    writer.release()
    with pytest.raises(InputError, match=r"clip\.avi: frame 0: is in colour"):
        stream(file)
    with pytest.raises(InputError, match="is a folder; the source 'video' takes"):
        stream(tmp_path)


def test_no_boxes_at_all_are_told(tmp_path):
    folder, _ = spot(tmp_path / "clip", frames=2)
    config = tomllib.loads(EXAMPLE.read_text())
    config["source"] |= {"path": str(folder), "boxes": np.zeros((0, 4))}
    with pytest.raises(ConfigError, match=r"source\.boxes: must be rows of \[x, y, w, h\].*got none"):
        vedette.load(config).run()


@pytest.mark.parametrize(
    ("pixels", "got"), [([[1, 2], [3]], "list"), (np.array([["a"]]), "<U1"), (np.ones((4, 4)) * 1j, "complex128")]
)
def test_a_frame_that_holds_no_numbers_is_refused(pixels, got):
    tracker = vedette.load(EXAMPLE).tracker
    n = len(tracker.state)
    none = Gaussian(np.zeros((0, n)), np.zeros((0, n, n)))
    with pytest.raises(ScanRefused, match=f"frame: pixels must be an array of real numbers, got {got}"):
        tracker.step(tracker.start(none), Scan.image(0.0, "camera", Frame(pixels)))


def test_a_video_is_no_table(tmp_path):
    file = tmp_path / "clip.avi"
    file.write_bytes(b"RIFF\0\1\2\0AVI LIST\0\0")
    with pytest.raises(InputError, match=r"is no text; a table is CSV.*`video`"):
        draft_config(file)
