"""A study on a real Dask cluster: equal to the local one, also when a worker dies, and clear when it cannot be."""

import json
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
from vedette_report import identity, provenance
from vedette_study import execution, executors
from vedette_study.plan import plan

dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")

SWEEP = {"estimator.motion.sigma_accel": [0.2, 0.5]}
CONFIG = boat(duration=20)


@pytest.fixture(scope="module")
def cluster():
    """It waits for workers that are killed: one that took more than 15 s to come back on a busy machine was given up."""
    options = {"dashboard_address": None, "silence_logs": 50, "host": "127.0.0.1"}
    with (
        dask.config.set({"distributed.deploy.lost-worker-timeout": "10m"}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **options) as made,
    ):
        yield made


@pytest.mark.costly
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


@pytest.mark.costly
def test_a_worker_without_the_plugin_is_told_and_finished_chunks_are_kept(cluster, of_here_alone, tmp_path):
    options = {"chunk": 5, "out": tmp_path / "out"}
    first = vedette.monte_carlo(of_here_alone, 10, 3, **options)
    wait_for_workers(cluster)
    with pytest.raises(vedette.ConfigError, match="lacks 'of_here_alone': install the same plugins"):
        vedette.monte_carlo(of_here_alone, 20, 3, resume=True, scheduler=cluster.scheduler_address, **options)
    again = vedette.monte_carlo(of_here_alone, 20, 3, resume=True, **options)
    for name, values in first.figures.items():
        np.testing.assert_array_equal(values, again.figures[name][:, :10])


@pytest.mark.costly
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
    assert executors.answer_of_worker(["kalman", "of_another_planet"], ())[0] == ["of_another_planet"]


def other_code(change="x"):
    """Make this process one with other sources, or the usual one again."""
    from vedette_report import identity
    from vedette_study import execution, executors

    own = identity.identity.__wrapped__
    found = own if change is None else lambda packages: own(packages) | {"sources of vedette": change}
    found.__wrapped__ = own
    identity.identity = execution.identity = executors.identity = found


@pytest.mark.costly
def test_a_worker_with_other_code_is_refused_before_and_while_it_works(cluster, capfd, tmp_path):
    """Once the version string alone was compared, which is always the same."""
    wait_for_workers(cluster)
    local = vedette.monte_carlo(CONFIG, 60, 3, chunk=10)
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        options = {"chunk": 10, "scheduler": client}
        (worker, *_) = client.scheduler_info(n_workers=-1)["workers"]

        def changed(runs, about):
            for i, done in enumerate(runs):
                if not i:
                    client.run(other_code, workers=[worker])
                yield done

        try:
            with pytest.raises(vedette.VedetteError, match="sources of vedette"):
                vedette.monte_carlo(CONFIG, 4000, 3, **options, out=tmp_path / "out", progress=changed)
            with pytest.raises(vedette.ConfigError, match="sources of vedette"):
                vedette.monte_carlo(CONFIG, 60, 3, **options)
            there = vedette.monte_carlo(CONFIG, 60, 3, **options, accept_other_code=True)
        finally:
            client.run(other_code, None)
        assert "sources of vedette" in capfd.readouterr().err
    for name, values in local.figures.items():
        np.testing.assert_array_equal(values, there.figures[name])


def test_kept_chunks_of_other_code_are_refused_or_recorded(monkeypatch, tmp_path, capfd):
    options = {"chunk": 10, "out": tmp_path / "out"}
    vedette.monte_carlo(CONFIG, 20, 3, **options)
    here = dict(provenance.identity(provenance.packages_of([CONFIG], "vedette_report", "vedette_study")))
    changed = here | {"kernels": "of another machine"}
    monkeypatch.setattr(identity, "identity", lambda packages: changed)
    monkeypatch.setattr(execution, "identity", lambda packages: changed)
    with pytest.raises(vedette.ConfigError, match="kernels"):
        vedette.monte_carlo(CONFIG, 30, 3, resume=True, **options)
    vedette.monte_carlo(CONFIG, 30, 3, resume=True, accept_other_code=True, **options)
    told = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert told["code"] == here
    assert told["also"] == [changed]
    assert "kernels" in capfd.readouterr().err


@pytest.mark.costly
def test_a_study_waits_for_workers_and_takes_those_that_join(capfd):
    """Once it ended with an error where there was none yet, as on a queue; and an adaptive cluster starts none unasked."""
    local = vedette.monte_carlo(CONFIG, 200, 3, chunk=10)
    options = {"dashboard_address": None, "silence_logs": 50, "host": "127.0.0.1", "threads_per_worker": 1}
    with distributed.LocalCluster(n_workers=0, processes=True, **options) as made:
        with pytest.raises(vedette.VedetteError, match="no worker"):
            vedette.monte_carlo(CONFIG, 200, 3, chunk=10, scheduler=made.scheduler_address, wait=0.5)
        made.adapt(minimum=0, maximum=2, interval="100ms")
        there = vedette.monte_carlo(CONFIG, 200, 3, chunk=10, scheduler=made.scheduler_address, wait=60.0)
    assert "no worker" in capfd.readouterr().err
    for name, values in local.figures.items():
        np.testing.assert_array_equal(values, there.figures[name])


@pytest.mark.costly
def test_chunks_follow_from_the_study_and_not_from_who_runs_it():
    sizes = {runs: plan({"experiment": CONFIG, "runs": runs}).chunk for runs in (100, 1000, 10_000)}
    assert all(-(-runs // size) * 5 >= min(runs // 20, 100) for runs, size in sizes.items() if runs == 10_000)
    assert sizes[10_000] <= 500


def wait_for_workers(cluster):
    deadline = time.monotonic() + 120
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        while not client.scheduler_info(n_workers=-1)["workers"] and time.monotonic() < deadline:
            time.sleep(0.05)
