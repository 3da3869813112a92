"""A process that works for another is killed: told in a line, which promises only what was kept."""

import multiprocessing
import os
import signal
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

import numpy as np
import pytest

import vedette
from support.clusters import boat
from support.reports import reports_frame
from vedette_study import study
from vedette_tools.smoothing.files import smooth_files
from vedette_tools.tuning import evaluator


class Broken:
    """An executor whose processes were killed."""

    def submit(self, *given):
        future = Future()
        future.set_exception(BrokenProcessPool("A process in the process pool was terminated abruptly"))
        return future

    def map(self, *given):
        yield self.submit().result()

    def shutdown(self, **options):
        pass


@contextmanager
def broken(*given):
    yield Broken(), lambda: 2


@pytest.mark.parametrize("out", [None, "out"])
def test_a_study_promises_to_go_on_only_where_chunks_are_kept(out, tmp_path, monkeypatch):
    """It said that the chunks in --out were kept where none was named."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study, "local", broken)
    with pytest.raises(vedette.VedetteError, match="a worker") as error:
        vedette.monte_carlo(boat(5), 4, chunk=1, threads=2, out=out)
    assert ("--resume" in str(error.value)) == (out is not None)


@pytest.mark.parametrize("out", [None, "out"])
def test_a_tuning_promises_to_go_on_only_where_evaluations_are_kept(out, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(evaluator, "processes", lambda *given: Broken())
    free = {"estimator.motion.sigma_accel": "0.1..10"}
    with pytest.raises(vedette.VedetteError, match="a worker") as error:
        vedette.tune(boat(20), free, workers=2, out=out)
    assert ("--resume" in str(error.value)) == (out is not None)


def test_a_smoothing_tells_it_in_a_line(tmp_path):
    """It ended with a traceback."""
    data = tmp_path / "plots.csv"
    reports_frame(objects=6, rows=60)[0].to_csv(data, index=False)
    with pytest.raises(vedette.VedetteError, match="worker was killed"):
        smooth_files([data], tmp_path / "out.csv", None, None, None, Broken(), lambda items, about: items)
    assert [path.name for path in tmp_path.iterdir()] == [data.name]


@pytest.mark.costly
def test_a_study_of_which_a_process_was_killed_is_resumed_to_the_same(tmp_path):
    def progress(runs, about):
        for number, run in enumerate(runs):
            if number == 2:
                os.kill(next(each.pid for each in multiprocessing.active_children()), signal.SIGKILL)
            yield run

    several = boat(5) | {"birth": {"kind": "from_returns", "spread": {"vx": 9, "vy": 9}}, "lifecycle": {"kind": "m_of_n"}}
    with pytest.raises(vedette.VedetteError, match=r"worker was killed.*--resume"):
        vedette.monte_carlo(several, 30, 3, chunk=1, threads=2, out=tmp_path, progress=progress)
    assert 3 <= len(list((tmp_path / "chunks").glob("*.npz"))) < 30
    alone = vedette.monte_carlo(several, 30, 3, chunk=1)
    resumed = vedette.monte_carlo(several, 30, 3, chunk=1, out=tmp_path, resume=True)
    assert resumed.figures.keys() == alone.figures.keys()
    for name, values in alone.figures.items():
        np.testing.assert_array_equal(values, resumed.figures[name])
