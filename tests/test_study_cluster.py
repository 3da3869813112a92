"""A study on a real Dask cluster: equal to the local one, also when a worker dies, and clear when it cannot be."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import vedette
from vedette.ensemble import executors

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
SWEEP = {"estimator.motion.sigma_accel": [0.2, 0.5]}
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

    def advance(done, total):
        if done >= 120 and not killed.is_set():
            killed.set()
            os.kill(victim, signal.SIGKILL)

    options = {"chunk": 30, "sweep": SWEEP, "scheduler": cluster.scheduler_address, "advance": advance}
    there = vedette.monte_carlo(CONFIG, 600, 3, **options)
    assert killed.is_set()
    for name, values in local.figures.items():
        np.testing.assert_array_equal(values, there.figures[name])


def test_a_worker_without_the_plugin_is_told(cluster, monkeypatch):
    own = executors.answer_of_worker

    def lacking(kinds):
        missing, versions = own(kinds)
        return [*missing, "kalman"], versions

    wait_for_workers(cluster)
    monkeypatch.setattr(executors, "answer_of_worker", lacking)
    with pytest.raises(vedette.ConfigError, match="lacks 'kalman': install the same plugins there as here"):
        vedette.monte_carlo(CONFIG, 4, scheduler=cluster.scheduler_address)


def test_a_kind_that_no_worker_has_is_missing():
    assert executors.answer_of_worker(["kalman", "of_another_planet"])[0] == ["of_another_planet"]
    assert set(executors.kinds_in(CONFIG)) == {
        *("simulation", "constant_velocity", "cartesian_position", "kalman", "pda", "single_target")
    }


def wait_for_workers(cluster):
    deadline = time.monotonic() + 30
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        while not client.scheduler_info(n_workers=-1)["workers"] and time.monotonic() < deadline:
            time.sleep(0.05)
