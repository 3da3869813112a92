"""A scheduler that dies in the middle of a study: told in one line, and what was finished is kept."""

import os
import signal
import subprocess
import sys

import pytest

import vedette
from support.clusters import boat, cluster

distributed = pytest.importorskip("distributed")

CONFIG = boat(duration=20)
CLUSTER = cluster("tcp://")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.costly
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

            impatient = distributed.Client(address, set_as_default=False)
            impatient._timeout = 1  # for its return alone: ours waits 10 s, and a busy machine may take long to connect
            impatient.wait_for_workers(1, timeout=120)  # or the study says that there is none
            study = {"progress": progress, "chunk": 20, "out": tmp_path / "out", "scheduler": impatient}
            with pytest.raises(vedette.VedetteError) as error:
                vedette.monte_carlo(CONFIG, 100_000, 3, **study)
        finally:
            there.kill()
    (line,) = str(error.value).splitlines()
    assert "the scheduler went away" in line
    assert "--resume continues" in line
    # on a busy machine the worker may be lost for a while before, which is told, too; distributed itself must tell nothing
    assert all(line.startswith("vedette: note: there is no worker") for line in capfd.readouterr().err.splitlines())
    assert list((tmp_path / "out" / "chunks").iterdir())
