"""Decoders in a process of their own: what they give is the same, and what ends them costs a frame or a file."""

import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("resource")
pytest.importorskip("cv2")

from fuzz import samples
from vedette import InputError
from vedette_files import Apart, ApartOpenCV, CsvSource
from vedette_files.apart import ApartTable, Decoder
from vedette_files.tables.columnar import parquet_cells
from vedette_files.tables.returns import DetectionColumns
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sources.images import look_through
from vedette_flir.sources.video import VideoSource
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures
from vedette_standard.sensors.cartesian_position import CartesianPosition

LIMITS = Apart(memory=512, seconds=60.0)


def pictures(folder, sizes, dtype=np.uint16):
    import cv2

    folder.mkdir()
    rng = np.random.default_rng(0)
    for i, size in enumerate(sizes):
        cv2.imwrite(str(folder / f"{i}.png"), rng.integers(0, 255, size).astype(dtype))
    return folder


@pytest.mark.costly
def test_frames_are_those_that_this_process_decodes(tmp_path):
    folder = pictures(tmp_path / "clip", [(20, 30)] * 3)
    here, there = look_through(folder), look_through(folder, apart=LIMITS)
    assert (there.shape, there.dtype, there.numbers) == (here.shape, here.dtype, here.numbers)
    for number in here.numbers:
        np.testing.assert_array_equal(there.frame(number), here.frame(number))


@pytest.mark.costly
def test_a_video_is_the_one_that_this_process_decodes(tmp_path):
    import cv2

    path = tmp_path / "a.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (64, 48), isColor=False)
    for i in range(4):
        writer.write(np.full((48, 64), 40 * i, np.uint8))
    writer.release()
    here, there = look_through(path), look_through(path, apart=LIMITS)
    assert (there.numbers, there.rate, there.problems) == (here.numbers, here.rate, here.problems)
    for number in (2, 0, 3):
        np.testing.assert_array_equal(there.frame(number), here.frame(number))


@pytest.mark.costly
def test_an_image_that_takes_too_much_memory_costs_one_frame(tmp_path):
    folder = pictures(tmp_path / "clip", [(20, 30), (4000, 4000), (20, 30)])
    assert look_through(folder).numbers == (0, 2)  # of another size
    clip = look_through(folder, apart=Apart(memory=40, seconds=60.0))
    assert clip.numbers == (0, 2)
    assert [problem.place for problem in clip.problems] == ["frame 1"]
    assert "memory" in str(clip.problems[0]).lower() or "40 MiB" in str(clip.problems[0])


@pytest.mark.costly
def test_a_process_that_hangs_or_dies_is_told_and_the_next_question_has_a_new_one(tmp_path):
    folder = pictures(tmp_path / "clip", [(8, 8)])
    reader = ApartOpenCV(LIMITS)
    assert reader.imread(str(folder / "0.png"), -1).shape == (8, 8)
    process = reader.decoder._process
    process.kill()
    process.wait()
    with pytest.raises(ValueError, match=r"512 MiB and 60 s: the process .* ended"):
        reader.imread(str(folder / "0.png"), -1)
    assert reader.imread(str(folder / "0.png"), -1).shape == (8, 8)
    reader.decoder._limits = Apart(memory=512, seconds=0.2)
    subprocess.run(["kill", "-STOP", str(reader.decoder._process.pid)], check=True)
    with pytest.raises(ValueError, match="takes longer"):
        reader.imread(str(folder / "0.png"), -1)
    assert reader.decoder._process is None


@pytest.mark.costly
def test_sources_ask_it_where_their_config_says_so(tmp_path, monkeypatch):
    asked = []
    ask = Decoder.ask
    monkeypatch.setattr(Decoder, "ask", lambda self, do, **what: (asked.append(do), ask(self, do, **what))[1])
    video = VideoSource(str(pictures(tmp_path / "clip", [(20, 30)] * 2)), box=np.array([4.0, 4, 3, 3]), apart=LIMITS)
    assert len(opened(video, GaussianSpot())) == 2
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pa.table({"t": [0.0, 1.0], "x": [1.0, 2.0], "y": [3.0, 4.0]}), tmp_path / "a.parquet")
    columns = DetectionColumns(time="t", columns={"x": "x", "y": "y"})
    assert len(opened(CsvSource(columns, str(tmp_path / "a.parquet"), apart=LIMITS), CartesianPosition(sigma=1.0))) == 2
    (tmp_path / "radar").mkdir()
    for name, data in samples.radar_pictures().items():
        (tmp_path / "radar" / name).write_bytes(data)
    frames = [scan.frame.pixels for scan in opened(RadarPictures(str(tmp_path / "radar"), apart=LIMITS), RadarScreen())]
    assert frames
    assert asked.count("imread") >= 4 + len(frames)
    assert "table" in asked


def opened(source, sensor):
    return list(source.open({"radar": sensor}, np.random.default_rng(0)).scans)


@pytest.mark.costly
def test_it_writes_no_file(tmp_path):
    """A decoder that was taken over can create files, but put nothing into them."""
    code = (
        "import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from vedette_files.decoder_process import _limit\n_limit(2**30)\n"
        f"open({str(tmp_path / 'a')!r}, 'wb', buffering=0).write(b'x')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, (tmp_path / "a").stat().st_size) == (1, 0)


@pytest.mark.costly
def test_tables_are_those_that_this_process_decodes(tmp_path):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path, n = tmp_path / "a.parquet", 10_000
    parquet.write_table(pa.table({"t": np.arange(n) / 7, "name": [f"é{i}" for i in range(n)], "x": np.arange(n)}), path)
    here, there = parquet_cells(path, {"t", "name"}), ApartTable(path, LIMITS).cells({"t", "name"})
    assert there[0] == here[0] == ["t", "name", "x"]
    assert list(there[1]) == list(here[1])
    (tmp_path / "b.parquet").write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"b\.parquet: cannot be read as Parquet"):
        ApartTable(tmp_path / "b.parquet", LIMITS).cells({"t"})


@pytest.mark.costly
def test_a_library_that_is_not_there_is_told(monkeypatch, tmp_path):
    (tmp_path / "cv2.py").write_text("raise ImportError('no')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(ValueError, match="OpenCV"):
        Decoder(LIMITS, "opencv").ask("imread", path="a", flags=-1)
