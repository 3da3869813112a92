"""A camera that turns: where its frames lie in the scene, and what becomes of targets there."""

import re

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette_flir import drafting, registration
from vedette_flir.drafting import draft
from vedette_flir.registration import Registration


def landscape(seed=0, size=(400, 900)):
    """Counts of a scene with structures of all sizes, as hills and clouds have."""
    rng = np.random.default_rng(seed)
    layers = [cv2.GaussianBlur(rng.normal(0.0, 1.0, size), (0, 0), width) * width for width in (2.0, 6.0, 20.0)]
    return (100.0 + 8.0 * np.sum(layers, axis=0)).astype(np.float32)


def seen(scene, corner, noise=1.0, seed=0):
    """The frame (160, 200) of a camera whose first pixel lies at `corner` in the scene."""
    move = np.float32([[1, 0, -corner[0]], [0, 1, -corner[1]]])
    frame = cv2.warpAffine(scene, move, (200, 160), flags=cv2.INTER_CUBIC)
    return frame + np.random.default_rng(seed).normal(0.0, noise, frame.shape)


def corners(path, scene, **options):
    """Where frames at places (k, 2) of a scene are found, from the first of them."""
    motion = Registration()
    return np.array([motion.take(seen(scene, at, seed=i, **options)) for i, at in enumerate(path)])


STEPS = {"a slow turn": [0.3, 0.1], "a fast one": [6.5, 1.2], "hardly any": [0.02, 0.0], "none": [0.0, 0.0]}


@pytest.mark.parametrize("step", STEPS.values(), ids=STEPS)
@pytest.mark.by_turns
def test_a_turning_camera_is_followed_without_drift(step):
    path = np.array([20.0, 20.0]) + np.arange(90)[:, None] * np.array(step)
    found = corners(path, landscape())
    assert np.abs(found - (path - path[0])).max() < 0.5


@pytest.mark.parametrize("shape", [(1, 1), (4, 7), (5, 300)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_frames_of_few_pixels_stand(shape, kind):
    frames, motion = np.random.default_rng(1).uniform(0.0, 200.0, (4, *shape)).astype(kind), Registration()
    assert np.abs([motion.take(each) for each in frames]).max() == 0.0


def test_a_jerk_and_the_way_back_are_followed():
    path = np.array([20.0, 20.0]) + np.array([[0.0, 0.0]] * 5 + [[12.0, -7.0]] * 5 + [[0.0, 0.0]] * 5)
    assert np.abs(corners(path, landscape()) - (path - path[0])).max() < 0.5


@pytest.mark.costly
def test_errors_add_up_where_each_frame_is_compared_with_the_one_before(monkeypatch):
    path = np.array([20.0, 20.0]) + np.arange(90)[:, None] * np.array([0.3, 0.1])
    right = np.abs(corners(path, landscape(), noise=6.0) - (path - path[0]))[-1].max()
    monkeypatch.setattr(registration, "NEAR", 0.0)
    assert np.abs(corners(path, landscape(), noise=6.0) - (path - path[0]))[-1].max() > 2.0 * right


TURNS = {"rolls": (4.0, 0.0), "zooms in": (0.0, 0.004), "zooms out": (0.0, -0.004), "does both": (4.0, 0.004)}


@pytest.mark.parametrize(("roll", "zoom"), TURNS.values(), ids=TURNS)
@pytest.mark.by_turns
def test_a_camera_that_rolls_and_zooms_as_it_turns_is_followed(monkeypatch, roll, zoom):
    """Its middle is where it is, in px of the first frame; the mutant believes a shift alone."""
    scene, off = landscape(), []
    for more in (registration.MORE, np.inf):
        monkeypatch.setattr(registration, "MORE", more)
        motion, far = Registration(), []
        for k in range(60):
            middle = (300.0 + 0.5 * k, 200.0)
            move = cv2.getRotationMatrix2D(middle, roll * np.sin(k / 8.0), 1.0 + zoom * k)
            move[:, 2] += np.array([99.5, 79.5]) - middle
            frame = cv2.warpAffine(scene, move, (200, 160), flags=cv2.INTER_CUBIC)
            found = motion.take(frame + np.random.default_rng(k).normal(0.0, 1.0, frame.shape))
            far.append(np.abs(found - np.array([0.5 * k, 0.0])).max())
        off.append(max(far))
    assert off[0] < 1.5
    assert off[1] > 2.0 * off[0]


def test_over_plain_sky_a_camera_stands_still():
    sky = np.full((400, 900), 80.0, dtype=np.float32)
    assert np.array_equal(corners(np.full((20, 2), 30.0), sky), np.zeros((20, 2)))


def lettered(frame):
    """A frame with text, a frame around its middle and a cross-hair written into it."""
    frame = np.clip(frame, 0.0, 255.0).astype(np.uint8)
    for words, at in (("-12.3C", (4, 14)), ("REC 00:12", (120, 14)), ("FOV 24.0", (4, 154)), ("N 51.2", (144, 154))):
        cv2.putText(frame, words, at, cv2.FONT_HERSHEY_PLAIN, 0.8, 255, 1)
    cv2.rectangle(frame, (70, 55), (130, 105), 255, 1)
    cv2.line(frame, (95, 80), (105, 80), 255, 1)
    return frame


FAINT = 80.0 + 0.3 * (landscape() - 100.0)


@pytest.mark.parametrize("scene", [landscape(), FAINT], ids=["a scene", "one much fainter than the text"])
@pytest.mark.by_turns
def test_text_in_the_frames_does_not_hold_the_camera(monkeypatch, scene):
    """Until it has turned by some pixels, nothing tells the two apart."""
    path, off = np.array([20.0, 20.0]) + np.arange(60)[:, None] * np.array([1.0, 0.4]), []
    for told in (True, False):
        if not told:  # nothing counts as written
            monkeypatch.setattr(registration, "written", lambda past, now, turn: (np.zeros(now.shape, dtype=bool),) * 2)
        motion = Registration()
        found = np.array([motion.take(lettered(seen(scene, at, seed=k))) for k, at in enumerate(path)])
        off.append(np.abs(found - (path - path[0]))[-1].max())
    assert off[0] < 4.0 < 10.0 < off[1]


@pytest.mark.costly
def test_what_is_no_longer_written_is_the_scene_again():
    path, motion = np.array([20.0, 20.0]) + np.arange(120)[:, None] * np.array([1.0, 0.4]), Registration()
    share = []
    for k, at in enumerate(path):
        frame = seen(landscape(), at, seed=k)
        motion.take(lettered(frame) if k < 45 else frame)
        share.append(motion._written.mean())
    assert share[44] > 0.2
    assert share[-1] < 0.8 * share[44]


@pytest.mark.parametrize("drift", [0.0, 1.5])
@pytest.mark.by_turns
def test_what_stands_and_is_large_is_the_scene_however_clouds_drift(drift):
    """Below a wood of half the frame, above clouds: the wood's pixels stand, and are more."""
    motion, wood = Registration(), seen(landscape(1), (40.0, 40.0), noise=0.0)
    for k in range(40):
        frame = seen(FAINT, (20.0 + drift * k, 20.0), seed=k)
        frame[70:] = wood[70:] + np.random.default_rng(k).normal(0.0, 1.0, wood[70:].shape)
        assert np.abs(motion.take(frame)).max() < 1.0  # the clouds go 58 px


def stretched(self, image):
    """A frame in 8 bits by its own levels, whatever those of the frame that is followed."""
    low, high = np.percentile(image[::4, ::4], (1, 99))
    return np.clip((image - low) * (255.0 / (high - low)), 0.0, 255.0).astype(np.uint8)


@pytest.mark.parametrize(("told", "least", "most"), [(True, 0.0, 0.1), (False, 5.0, np.inf)], ids=["told", "not told"])
@pytest.mark.parametrize("base", ["slope", "stripes"])
@pytest.mark.by_turns
def test_noise_over_a_slope_does_not_turn_a_camera(monkeypatch, base, told, least, most):
    """Along it nothing but noise has corners; the mutant takes them for the scene's."""
    if not told:
        monkeypatch.setattr(registration, "bend", lambda frame: 0.0)
    along, far = np.arange(160) * np.ones((120, 1)), []
    scene = 50.0 + (0.5 * along if base == "slope" else 20.0 * np.sin(along / 15.0))
    for run in range(4):
        motion, rng = Registration(), np.random.default_rng(run)
        for _ in range(40):
            found = motion.take((scene + rng.normal(0.0, 3.0, scene.shape)).clip(0, 255).astype(np.uint8))
        far.append(np.abs(found).max())
    assert least <= max(far) < most


@pytest.mark.parametrize(("shown", "least", "most"), [(Registration._shown, 0.0, 1.0), (stretched, 3.0, np.inf)])
@pytest.mark.by_turns
def test_the_sky_is_followed_as_land_comes_into_the_picture_and_leaves_it(monkeypatch, shown, least, most):
    """The strip is a hundred times as bright as what the sky shows: by its levels the sky would change, too."""
    monkeypatch.setattr(Registration, "_shown", shown)
    scene = 80.0 + 0.2 * (landscape() - 100.0)
    scene[230:] += 100.0
    turn = np.arange(90)
    path = np.stack([20.0 + 0.5 * turn, 60.0 + 20.0 * np.sin(turn / 8.0)], axis=1)
    off = np.abs(corners(path, scene, noise=0.5) - (path - path[0]))
    assert least <= off.max() < most


@pytest.mark.parametrize("speed", [0.5, 2.5])
@pytest.mark.by_turns
def test_a_faint_fixed_pattern_in_the_sky_does_not_hold_a_camera(speed):
    """A strip of land tells how it turns, though most of the frame stands."""
    land, pattern = landscape(), 0.1 * (landscape(seed=5)[:160, :200] - 100.0)
    scene, path = np.full(land.shape, 80.0, np.float32), np.array([20.0, 20.0]) + np.arange(60)[:, None] * [speed, 0.0]
    scene[150:], pattern[125:] = land[150:] + 60.0, 0.0
    motion = Registration()
    found = [motion.take(seen(scene, at, noise=0.5, seed=k) + pattern) for k, at in enumerate(path)]
    assert np.abs(found - (path - path[0])).max() < 0.5


def test_a_frame_of_another_size_is_refused():
    motion = Registration()
    motion.take(seen(landscape(), (20.0, 20.0)))
    with pytest.raises(ValueError, match="frame: "):
        motion.take(seen(landscape(), (20.0, 20.0))[:80])


@pytest.mark.parametrize("turn", [0.0, 1.5])
@pytest.mark.costly
def test_a_bright_target_does_not_turn_the_camera(turn):
    path = np.array([20.0, 20.0]) + np.arange(30)[:, None] * np.array([turn, 0.4 * turn])
    motion, alone = Registration(), Registration()
    for k, at in enumerate(path):
        frame, sky = seen(landscape(), at, seed=k), 80.0 + np.random.default_rng(k).normal(0.0, 1.0, (160, 200))
        for picture in (frame, sky):
            picture[60:74, 3 * k + 10 : 3 * k + 40] += 60.0
        assert np.abs(motion.take(frame) - (at - path[0])).max() < 2.0  # it goes 87 px, and pulls by 1
        assert np.array_equal(alone.take(sky), np.zeros(2))


@pytest.mark.costly
def test_a_cut_and_a_lost_frame_move_nothing_and_what_follows_is_followed():
    path = np.array([20.0, 20.0]) + np.arange(20)[:, None] * np.array([2.0, 0.0])
    motion, other = Registration(), landscape(1)
    first = [motion.take(seen(landscape(), at, seed=i)) for i, at in enumerate(path)]
    assert np.array_equal(motion.take(np.full((160, 200), np.nan)), first[-1])
    second = np.array([motion.take(seen(other, at, seed=50 + i)) for i, at in enumerate(path)])
    assert np.array_equal(second[0], first[-1])
    assert np.abs(second - second[0] - (path - path[0])).max() < 0.5


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A folder of frames of a shaken camera that turns after a spot, and the true boxes of the spot beside it."""
    folder = tmp_path_factory.mktemp("clip") / "clip"
    folder.mkdir()
    rng, scene = np.random.default_rng(3), landscape()
    rows = ["frame,x,y,w,h"]
    for k in range(60):
        corner = np.array([30.0 + 4.0 * k, 40.0]) + rng.normal(0.0, 1.5, 2)
        frame, at = seen(scene, corner, seed=k), np.array([130.0 + k, 120.0]) + 3.0 * k * np.array([1.0, 0.0]) - corner
        y, x = np.mgrid[:160, :200]
        frame += 90.0 * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0)
        cv2.imwrite(str(folder / f"{k:03}.png"), np.clip(frame, 0, 255).astype(np.uint8))
        rows.append(f"{k},{at[0] - 4.5 + 1:.2f},{at[1] - 4.5 + 1:.2f},10,10")
    (folder.parent / "clip_truth.csv").write_text("\n".join(rows) + "\n")
    return folder


@pytest.mark.parametrize("source", ["video", "video_stream"])
@pytest.mark.costly
def test_velocities_are_those_in_the_scene(source, clip):
    """4 px a frame in the scene at 30 frames a second; in the picture nearly none, but for what the hand shakes."""
    overrides = ["estimator.motion.motion.shake=0.0", "estimator.motion.motion.sigma_accel=30.0"]
    if source == "video":
        overrides += [f"source.path={clip}", "source.steady=true"]
    else:
        box = (clip.parent / "clip_truth.csv").read_text().split()[1].split(",")[1:]
        video = clip.parent / "clip.avi"
        writer = cv2.VideoWriter(str(video), cv2.VideoWriter_fourcc(*"FFV1"), 30.0, (200, 160), isColor=False)
        for file in sorted(clip.iterdir()):
            writer.write(cv2.imread(str(file), cv2.IMREAD_UNCHANGED))
        writer.release()
        given = {"kind": "video_stream", "address": str(video), "box": [float(cell) for cell in box], "steady": True}
        overrides += [f"source={given}".replace("True", "true").replace("'", '"').replace('": ', '"= ')]
    experiment = vedette.load(EXAMPLES / "flir_clip.toml", overrides=overrides)
    result = experiment.run()
    (track,) = result.tracks
    names = experiment.tracker.state.names
    velocity = track.mean[20:, [names.index("vx"), names.index("vy")]]
    assert np.abs(velocity.mean(axis=0) - [120.0, 0.0]).max() < 5.0
    assert np.std(velocity, axis=0).max() < 20.0
    if source == "video":
        assert result.score().position_rmse_m < 1.5
        assert np.ptp(track.mean[:, names.index("x")]) > 200.0, "as far as the camera turned"
        assert re.search(r"turns by up to 2[34]\d px", result.recording.notes["camera"])


@pytest.mark.parametrize(("shows", "steady"), [(True, "true"), (False, "false")], ids=["a scene", "noise over a slope"])
@pytest.mark.costly
def test_a_draft_takes_out_turns_that_frames_can_tell(tmp_path, shows, steady):
    """By noise alone the camera would seem to turn, and targets to stand where they do not."""
    slope, noise = 0.5 * np.arange(200.0), np.random.default_rng(0)
    for k in range(40):
        frame = (
            seen(landscape(), (20.0 + 0.3 * k, 20.0), seed=k) if shows else 60.0 + slope + noise.normal(0.0, 1.5, (160, 200))
        )
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.clip(frame, 0, 255).astype(np.uint8))
    assert f"steady = {steady} " in draft(tmp_path, {})


@pytest.mark.costly
def test_a_draft_takes_out_a_turn_before_plain_sky(tmp_path, monkeypatch):
    """A codec draws the sky anew, and its corners agree with none; that the frames are more alike says that hills turn."""
    rng = np.random.default_rng(3)
    for k in range(60):
        frame = seen(landscape(), (20.0 + 0.8 * k, 20.0), seed=k)
        frame[:110] = 80.0 + 10.0 * cv2.GaussianBlur(rng.normal(0.0, 1.0, (110, 200)), (0, 0), 2.0)
        cv2.imwrite(str(tmp_path / f"{k:02}.png"), np.clip(frame, 0, 255).astype(np.uint8))
    assert "steady = true " in draft(tmp_path, {})
    monkeypatch.setattr(drafting, "ALIKE", 0.0)
    assert "steady = false " in draft(tmp_path, {}), "by the corners alone"
