"""A study on a real Dask cluster: equal to the local one, also when a worker dies, and clear when it cannot be."""

import os
import signal
import socket
import sys
import threading
import time

import numpy as np
import pytest

import vedette
from support.clusters import boat
from vedette_study import execution, executors

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")

SWEEP = {"estimator.motion.sigma_accel": [0.2, 0.5]}
CONFIG = boat(duration=20)


@pytest.fixture(scope="module")
def cluster():
    options = {"dashboard_address": None, "silence_logs": 50, "host": "127.0.0.1"}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **options) as made:
        yield made


def test_a_worker_that_dies_changes_nothing(cluster):
    local = vedette.monte_carlo(CONFIG, 600, 3, chunk=30, sweep=SWEEP)
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        victim = next(iter(client.run(os.getpid).values()))
    killed = threading.Event()

    def progress(runs, about):
        for done in runs:
            if done >= 120 and not killed.is_set():
                killed.set()
                os.kill(victim, signal.SIGKILL)
            yield done

    options = {"chunk": 30, "sweep": SWEEP, "scheduler": cluster.scheduler_address, "progress": progress}
    there = vedette.monte_carlo(CONFIG, 600, 3, **options)
    assert killed.is_set()
    for name, values in local.figures.items():
        np.testing.assert_array_equal(values, there.figures[name])


STILL = """
import attrs, vedette
from vedette_standard.associators.pda import Pda

VEDETTE_CONTRACT = 2

@vedette.plugin
def vedette_components():
    return [attrs.make_class("Own", {}, (vedette.Associator,), frozen=True, class_body={
        "kind": "of_here_alone", "associate": lambda self, scores, evidence: Pda().associate(scores, evidence)})]
"""


@pytest.fixture
def of_here_alone(tmp_path, monkeypatch):
    """A plugin that is installed in this process alone."""
    info = tmp_path / "site" / "alone-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: alone\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[vedette]\nalone = alone_plugin\n")
    (tmp_path / "site" / "alone_plugin.py").write_text(STILL)
    monkeypatch.syspath_prepend(tmp_path / "site")
    yield CONFIG | {"associator": {"kind": "of_here_alone"}}
    sys.modules.pop("alone_plugin", None)


def test_a_worker_without_the_plugin_is_told_and_finished_chunks_are_kept(cluster, of_here_alone, tmp_path):
    options = {"chunk": 5, "out": tmp_path / "out"}
    first = vedette.monte_carlo(of_here_alone, 10, 3, **options)
    wait_for_workers(cluster)
    with pytest.raises(vedette.ConfigError, match="lacks 'of_here_alone': install the same plugins"):
        vedette.monte_carlo(of_here_alone, 20, 3, resume=True, scheduler=cluster.scheduler_address, **options)
    again = vedette.monte_carlo(of_here_alone, 20, 3, resume=True, **options)
    for name, values in first.figures.items():
        np.testing.assert_array_equal(values, again.figures[name][:, :10])


def test_a_chunk_that_kills_its_workers_ends_the_study_and_keeps_the_others(cluster, monkeypatch, tmp_path):
    monkeypatch.setattr(cluster.scheduler, "allowed_failures", 0)
    own = execution.attempt

    def fatal(config, seed, runs, *rest):
        return os._exit(1) if runs.start == 160 else own(config, seed, runs, *rest)

    wait_for_workers(cluster)
    options = {"chunk": 20, "out": tmp_path / "out"}
    with monkeypatch.context() as patched:
        patched.setattr(execution, "attempt", fatal)
        with pytest.raises(vedette.VedetteError, match=r"a worker failed: KilledWorker.*--resume continues"):
            vedette.monte_carlo(CONFIG, 200, 3, scheduler=cluster.scheduler_address, **options)
    kept = {path.name for path in (tmp_path / "out" / "chunks").iterdir()}
    assert len(kept) >= 5
    assert "00000-0000008.npz" not in kept
    resumed, local = (
        vedette.monte_carlo(CONFIG, 200, 3, resume=True, **options),
        vedette.monte_carlo(CONFIG, 200, 3, chunk=20),
    )
    for name, values in local.figures.items():
        np.testing.assert_array_equal(values, resumed.figures[name])


def test_a_server_of_another_kind_is_no_scheduler():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer():
            line, _ = server.accept()
            with line:
                line.sendall(b"HTTP/1.1 400 Bad Request\r\n" * 20)

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(vedette.ConfigError, match="no Dask scheduler answers at"):
            vedette.monte_carlo(CONFIG, 4, scheduler=f"tcp://127.0.0.1:{server.getsockname()[1]}")


def test_a_kind_that_no_worker_has_is_missing():
    assert executors.answer_of_worker(["kalman", "of_another_planet"])[0] == ["of_another_planet"]
    assert set(executors.kinds_in(CONFIG)) == {
        *("simulation", "constant_velocity", "cartesian_position", "kalman", "pda", "given", "single_target")
    }


def wait_for_workers(cluster):
    deadline = time.monotonic() + 30
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        while not client.scheduler_info(n_workers=-1)["workers"] and time.monotonic() < deadline:
            time.sleep(0.05)
