"""Smoothing on a Dask cluster: the same as by one process, also where a worker is killed on the way."""

import os
import signal

import numpy as np
import pytest

from vedette.progress import silent
from vedette_tools.smoothing import files

pd = pytest.importorskip("pandas")
distributed = pytest.importorskip("distributed")


def reports(folder, objects=40, each=100):
    rng = np.random.default_rng(4)
    start, pace = rng.uniform(-5e3, 5e3, (objects, 2)), rng.normal(0, 5.0, (objects, 2))
    when = np.arange(each) * 10.0
    spots = start + when[:, None, None] * pace + rng.normal(0, 8.0, (each, objects, 2))
    frame = pd.DataFrame(
        {
            "time": np.repeat(when, objects), "mmsi": np.tile(235_000_000 + np.arange(objects), each),
            "x": spots[..., 0].ravel(), "y": spots[..., 1].ravel(),
        }
    )  # fmt: skip
    frame.to_parquet(folder / "d.parquet", index=False)
    return folder / "d.parquet"


@pytest.mark.filterwarnings("ignore")
@pytest.mark.nightly("starts three processes and waits until the scheduler knows that one is gone: 15 s")
def test_a_worker_that_is_killed_loses_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "ROWS", 200)
    data, alone, there = reports(tmp_path), tmp_path / "alone.parquet", tmp_path / "there.parquet"
    told, *_ = files.smooth_files([data], alone, "mmsi", None, None, None, silent)
    options = {"dashboard_address": None, "silence_logs": 50, "host": "127.0.0.1", "threads_per_worker": 1}
    killed = []

    def kills(items, about):
        for number, item in enumerate(items):
            if about == "smoothing" and number == 2:
                killed.append(victim)
                os.kill(victim, signal.SIGKILL)
            yield item

    with (
        distributed.LocalCluster(n_workers=2, processes=True, **options) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        victim = next(iter(client.run(os.getpid).values()))
        again, *_ = files.smooth_files([data], there, "mmsi", None, None, client.get_executor(), kills)
    assert killed
    assert told == again
    pd.testing.assert_frame_equal(pd.read_parquet(alone), pd.read_parquet(there))
    assert told.written == 4000
