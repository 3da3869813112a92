"""A scheduler that dies in the middle of a study: told in one line, and what was finished is kept."""

import os
import signal
import subprocess
import sys

import pytest

import vedette

distributed = pytest.importorskip("distributed")

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
CONFIG = {
    "source": {
        "kind": "simulation",
        "duration": 20,
        "looks": {"radar": {"interval": 1}},
        "drawn": {"boat": {"models": [CV], "start": START}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9}},
    "estimator": {"kind": "kalman", "motion": CV},
    "associator": {"kind": "pda"},
    "lifecycle": {"kind": "single_target", "start": START},
}
CLUSTER = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    made = LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50,
                        protocol="tcp://", host="127.0.0.1")
    print(made.scheduler_address, flush=True)
    sys.stdin.read()
"""


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_dies_is_told_in_a_line(tmp_path, capfd):
    options = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen([sys.executable, "-c", CLUSTER], **options) as there:
        try:
            address = there.stdout.readline().strip()
            capfd.readouterr()

            def progress(runs, about):
                for done in runs:
                    os.kill(there.pid, signal.SIGKILL)
                    yield done

            study = {"progress": progress, "chunk": 20, "out": tmp_path / "out", "scheduler": address}
            with pytest.raises(vedette.VedetteError) as error:
                vedette.monte_carlo(CONFIG, 100_000, 3, **study)
        finally:
            there.kill()
    (line,) = str(error.value).splitlines()
    assert "the scheduler went away" in line
    assert "--resume continues" in line
    assert capfd.readouterr().err == ""
    assert list((tmp_path / "out" / "chunks").iterdir())
