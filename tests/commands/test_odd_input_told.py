"""What looks wrong with the input is told by every command that reads it, not by `vedette run` alone."""

import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette_report.recorded import recorded_consistency

CONFIG = """
[source]
kind = "csv"
path = "{path}"
[source.detections]
time = "t"
columns = {{ range = "r", bearing = "b" }}
[sensors.radar]
kind = "range_bearing"
sigma_range = 6.0
sigma_bearing = "0.3 deg"
detection_probability = 0.9
clutter_per_scan = 0.1
max_range = 4000
[estimator]
kind = "ekf"
motion = {{ kind = "constant_velocity", sigma_accel = 0.05 }}
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
spread = {{ vx = 8.0, vy = 8.0 }}
[lifecycle]
kind = "existence"
"""


@pytest.fixture
def config(tmp_path):
    """Return a function that writes a recording of one boat and a config: its bearings by a factor, its rows in an order."""

    def write(factor=1.0, order=None):
        rng, times = np.random.default_rng(3), np.arange(0.0, 120.0, 2.0)
        x, y = 500.0 + 8.0 * times, 900.0 - 3.0 * times
        r, b = np.hypot(x, y) + rng.normal(0, 6, 60), (np.arctan2(y, x) + rng.normal(0, 0.005, 60)) * factor
        rows = [f"{row[0]},{row[1]:.2f},{row[2]:.5f}\n" for row in zip(times, r, b, strict=True)]
        rows = rows if order is None else [rows[i] for i in order]
        (tmp_path / "radar.csv").write_text("t,r,b\n" + "".join(rows))
        (tmp_path / "radar.toml").write_text(CONFIG.format(path=tmp_path / "radar.csv"))
        return str(tmp_path / "radar.toml")

    return write


SHUFFLED = np.random.default_rng(0).permutation(60)
TUNE = ["--free", "sensors.radar.sigma_range=2..20", "--starts", "1"]


DEGREES = (57.29578, None, "are the values in degrees? Then state it")
MIXED, RIGHT = (1.0, SHUFFLED, "in time"), (1.0, None, None)


@pytest.mark.parametrize(
    ("command", "factor", "order", "told"),
    [
        *(("explain", *each) for each in (DEGREES, MIXED, RIGHT)),
        *(("consistency", *each) for each in (DEGREES, MIXED, RIGHT)),
        ("tune", *MIXED),
        *(("watch", *each) for each in (DEGREES, MIXED, RIGHT)),
        *(("study", *each) for each in (DEGREES, MIXED, RIGHT)),
    ],
)
@pytest.mark.by_turns
def test_every_command_that_reads_a_recording_says_what_looks_wrong_with_it(
    config, tmp_path, capsys, command, factor, order, told
):
    more = [*TUNE, "--out", str(tmp_path / "tuned")] if command == "tune" else []
    given = config(factor, order)
    if command == "study":
        (tmp_path / "study.toml").write_text('experiment = "radar.toml"\nruns = 2\n')
        given, more = str(tmp_path / "study.toml"), ["--threads", "1"]
    more += ["--terminal", "--speed", "max"] if command == "watch" else []
    code = main([command, given, *more])
    out, err = capsys.readouterr()
    if told is None:
        assert code == 0
        assert "LOOKS WRONG" not in out
        assert not out.rstrip().endswith("of proportion") or "nothing is out of proportion" in out
        return
    said = " ".join((out + err).split())
    assert told in said
    if command != "explain":
        assert (
            f"LOOKS WRONG: {'radar' if order is None else 'most'}" in out or "to judge by; " in err or "to tune on: " in err
        )


def test_a_recording_that_cannot_be_judged_is_told_with_its_cause(config):
    with pytest.raises(vedette.InputError, match="to judge by; most"):
        recorded_consistency(vedette.load(config(1.0, np.arange(60)[::-1])))


def test_a_study_without_a_figure_says_so(config, tmp_path, capsys):
    quiet = tmp_path / "quiet.csv"
    config()
    quiet.write_text("t,r,b\n" + "".join(f"{t},,\n" for t in range(20)))
    (tmp_path / "study.toml").write_text('experiment = "radar.toml"\nruns = 2\n')
    assert main(["study", str(tmp_path / "study.toml"), "--threads", "1", "--set", f"source.path={quiet}"]) == 0
    assert "no figure exists: no run confirmed a track" in capsys.readouterr().out


def test_a_quiet_sea_is_watched_without_a_warning(config, tmp_path, capsys):
    quiet = tmp_path / "quiet.csv"
    given = config()
    quiet.write_text("t,r,b\n" + "".join(f"{t},,\n" for t in range(20)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["watch", given, "--terminal", "--speed", "max", "--set", f"source.path={quiet}"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="files have no limit here")
@pytest.mark.costly
def test_a_full_disk_is_told_with_the_folder_of_a_streamed_run(config, tmp_path):
    given, out = config(), tmp_path / "out"
    limit = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); from vedette.cli import main; "
    line = f"{limit}sys.exit(main({['run', given, '--stream', '--out', str(out)]}))"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert done.stderr == f"vedette: error: {out}: File too large; what was there before stays\n"
    assert not out.exists(), "no block was complete, so there is nothing to see"
