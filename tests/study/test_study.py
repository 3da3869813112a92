"""Studies of many runs: their figures, what they do not depend on, their files, and what they refuse."""

import json
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette_study.chunk import run_chunk
from vedette_study.seeds import sequence
from vedette_study.statistics import difference, mean, ratios

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
ACCEL = "estimator.motion.sigma_accel"
SWEEP = {ACCEL: [0.2, 0.5]}


def config(clutter=True, steps=10, **more):
    box = {"x": {"low": -300, "high": 400}, "y": {"low": -300, "high": 400}}
    return {
        "source": {
            "kind": "simulation",
            "duration": steps,
            "looks": {"radar": {"interval": 1, **({"clutter": box} if clutter else {})}},
            "drawn": {"boat": {"models": [CV], "start": START}},
        },
        "sensors": {
            "radar": {"kind": "cartesian_position", "sigma": 5.0}
            | ({"clutter_density": 1e-5, "detection_probability": 0.9} if clutter else {})
        },
        "estimator": {"kind": "kalman", "motion": CV},
        "gate": {"probability": 0.999},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": START},
        "lifecycle": {"kind": "single_target"},
        **more,
    }


def several():
    birth = {"kind": "from_returns", "spread": {"vx": 10, "vy": 10}}
    made = config(steps=6, birth=birth, lifecycle={"kind": "m_of_n"}, associator={"kind": "jpda"})
    made["source"]["ships"] = {"other": {"start": [100, 0], "speed": 3}}
    return made


def equal(a, b, exactly=True):
    for name, values in a.figures.items():
        close = np.testing.assert_array_equal if exactly else lambda x, y: np.testing.assert_allclose(x, y, 1e-9, 1e-12)
        close(values, b.figures[name])
    for one, other in zip(a.against, b.against, strict=True):
        for name, values in one.values.items():
            close(values, other.values[name])


@pytest.fixture(scope="module")
def undisturbed():
    return vedette.monte_carlo(config(), 60, 3, chunk=10, sweep=SWEEP)


def write(folder, **table):
    table = {"experiment": config(), "runs": 60, "seed": 3, "chunk": 10, "sweep": SWEEP} | table
    path = folder / "study.json"
    path.write_text(json.dumps(table))
    return path


@pytest.mark.statistical(alpha=2e-3)
def test_a_matched_filter_is_as_wrong_as_it_says():
    runs = vedette.monte_carlo(config(clutter=False, gate={"probability": 1 - 1e-9}), 1000, 1).means(0)
    for name in ("nees", "nis"):
        assert abs(runs[name].value - 1) < 3.29 * runs[name].error


def test_too_trusting_a_filter_shows_in_both():
    found = vedette.monte_carlo(config(clutter=False, steps=40), 300, 1, sweep={ACCEL: [0.05]}).means(0)
    assert found["nees"].value > 1 + 10 * found["nees"].error
    assert found["nis"].value > 1 + 5 * found["nis"].error


def test_a_run_is_the_same_in_any_company():
    made = vedette.load(config())
    whole, part = (
        run_chunk(made, 3, range(20), True),
        run_chunk(made, 3, range(13, 15), True),
    )
    for name, values in whole.figures.items():
        np.testing.assert_allclose(part.figures[name], values[13:15], 1e-9, 1e-12)
    assert not np.allclose(part.figures["position_rmse"], run_chunk(made, 3, range(2), True).figures["position_rmse"])


def test_runs_draw_from_their_own_seed_sequence():
    assert sequence(3, 5).generate_state(4).tolist() == np.random.SeedSequence(3, spawn_key=(5,)).generate_state(4).tolist()


@pytest.mark.parametrize(("exactly", "options"), [(True, {"threads": 2}), (False, {"chunk": 7}), (False, {"chunk": 60})])
@pytest.mark.by_turns
def test_neither_threads_nor_chunks_change_the_result(undisturbed, exactly, options):
    equal(undisturbed, vedette.monte_carlo(config(), 60, 3, sweep=SWEEP, **{"chunk": 10} | options), exactly)


def test_points_share_their_random_numbers():
    both = vedette.monte_carlo(config(), 200, 3, sweep={ACCEL: [0.5, 0.5, 0.8]})
    assert all(each.value == each.error == 0 for each in both.differences(1).values())
    paired, alone = both.differences(2)["position_rmse"], both.means(2)["position_rmse"]
    assert paired.error < 0.7 * alone.error * np.sqrt(2)


def test_trackers_are_compared():
    made = vedette.monte_carlo(
        config(), 20, trackers={"pda": {}, "gnn": {"associator.kind": "gnn"}}, sweep={ACCEL: [0.4, 0.5]}
    )
    assert [at.labels["tracker"] for at in made.plan.points] == ["pda", "pda", "gnn", "gnn"]
    assert made.plan.points[2].config["associator"]["kind"] == "gnn"


@pytest.mark.costly
def test_standard_errors_are_those_of_repeated_studies():
    rng = np.random.default_rng(1)
    many = rng.gamma(2.0, 1.0, (4000, 100))
    errors = np.array([[mean("position_rmse", row).value, mean("position_rmse", row).error] for row in many])
    assert np.isclose(errors[:, 0].std(), errors[:, 1].mean(), rtol=0.06)
    other = many + rng.gamma(2.0, 0.1, many.shape)
    gaps = np.array([[(d := difference("position_rmse", a, b)).value, d.error] for a, b in zip(many, other, strict=True)])
    assert np.isclose(gaps[:, 0].std(), gaps[:, 1].mean(), rtol=0.06)
    e = rng.gamma(3.0, 1.0, many.shape)
    v = e * rng.gamma(2.0, 0.5, many.shape)
    sums = np.stack([np.sum(each, axis=1) for each in (v, v**2, e, e**2, v * e)])
    ratio, error = ratios(sums, 100)
    assert np.isclose(ratio.std(), error.mean(), rtol=0.06)


@pytest.mark.costly
def test_several_targets_run_one_by_one_in_processes_too():
    here = vedette.monte_carlo(several(), 4, 1, chunk=2)
    assert not here.plan.together
    assert {"gospa", "coverage", "position_rmse"} <= set(here.figures)
    equal(here, vedette.monte_carlo(several(), 4, 1, chunk=2, threads=2))


def test_a_study_stops_when_it_is_precise_enough():
    options = {"chunk": 20, "precision": {"position_rmse": "0.4 m"}}
    found = vedette.monte_carlo(config(), 2000, 1, **options)
    assert 20 <= found.runs < 2000
    assert found.means(0)["position_rmse"].error <= 0.4
    before = vedette.monte_carlo(config(), found.runs - 20, 1, chunk=20) if found.runs > 20 else None
    assert before is None or before.means(0)["position_rmse"].error > 0.4
    equal(found, vedette.monte_carlo(config(), 2000, 1, threads=2, **options))


def test_precision_of_a_figure_that_no_point_has_is_refused_rather_than_reached():
    with pytest.raises(vedette.ConfigError) as caught:
        vedette.monte_carlo(config(), 40, 1, chunk=20, precision={"gospa": "1 m"})
    assert caught.value.problems[0].place == "precision.gospa"


@pytest.mark.costly
def test_files_of_a_study(tmp_path, capsys, undisturbed):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    out = tmp_path / "out"
    assert main(["study", str(write(tmp_path)), "--out", str(out), "--threads", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["table"] == json.loads(json.dumps(undisturbed.table()))
    assert len((out / "summary.csv").read_text().splitlines()) == 3
    assert {"time.png", "sweep_sigma_accel.png", "summary.txt"} <= {path.name for path in out.iterdir()}
    with xarray.open_zarr(out / "study.zarr", consolidated=False) as found:
        assert found.sigma_accel.values.tolist() == [0.2, 0.5]
        np.testing.assert_array_equal(found.run_nees.values, undisturbed.figures["nees"])
        assert found.attrs["seed"] == 3
        assert json.loads(found.attrs["study"])["runs"] == 60


def killed(path, out, chunks, seconds):
    """Begin the study in a process of its own, and kill it so long after it has finished so many chunks."""
    apart = multiprocessing.get_context("forkserver")
    apart.set_forkserver_preload(["vedette.cli", "vedette_study.commands.study"])
    child = apart.Process(target=main, args=(["study", str(path), "--out", str(out), "--threads", "1"],))
    child.start()
    deadline = time.monotonic() + 60
    while child.is_alive() and time.monotonic() < deadline and len(list(out.glob("chunks/*.npz"))) < chunks:
        time.sleep(0.001)
    time.sleep(seconds)
    child.kill()
    child.join()
    return child.exitcode


@pytest.mark.costly
def test_killed_at_random_moments_and_resumed_equals_undisturbed(tmp_path, undisturbed):
    """Four times: after none to nine of the twelve chunks, and a random while."""
    path, rng, codes = write(tmp_path), np.random.default_rng(1), []
    for i in (0, 1, 5, 9):
        out = tmp_path / f"out{i}"
        codes.append(killed(path, out, i, rng.uniform(0.0, 0.02)))
        assert len(list(out.glob("chunks/*.npz"))) >= i
        equal(undisturbed, vedette.monte_carlo(config(), 60, 3, chunk=10, sweep=SWEEP, out=out, resume=True))
    assert codes.count(-signal.SIGKILL) > 1, "most were to be killed before they were done"


def test_resuming_runs_only_what_is_missing(tmp_path, undisturbed, monkeypatch):
    options = {"chunk": 10, "sweep": SWEEP, "out": tmp_path}
    vedette.monte_carlo(config(), 60, 3, **options)
    (tmp_path / "chunks" / "00001-0000002.npz").write_bytes(b"torn")
    (tmp_path / "chunks" / "00000-0000004.npz").unlink()
    from vedette_study import execution

    done = []
    monkeypatch.setattr(execution, "run_chunk", lambda *given: (done.append(given[2]), run_chunk(*given))[1])
    equal(undisturbed, vedette.monte_carlo(config(), 60, 3, resume=True, **options))
    assert done == [range(20, 30), range(40, 50)]


def test_ctrl_c_keeps_what_all_points_have(monkeypatch, undisturbed):
    from vedette_study import execution

    left = iter(range(5))

    def chunk(*given):
        if next(left, None) is None:
            raise KeyboardInterrupt
        return run_chunk(*given)

    monkeypatch.setattr(execution, "run_chunk", chunk)
    found = vedette.monte_carlo(config(), 60, 3, chunk=10, sweep=SWEEP)
    assert found.interrupted
    assert found.runs == 20
    np.testing.assert_array_equal(found.figures["nees"], undisturbed.figures["nees"][:, :20])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"runs": 0}, "runs: must be a whole number from 1"),
        ({"runs": True}, "runs: must be a whole number"),
        ({"seed": -1}, "seed: must be"),
        ({"threads": 0}, "threads: must be"),
        ({"sweep": {"estimator.motoin.sigma_accel": [1.0]}}, "did you mean 'motion'"),
        ({"sweep": {"estimator.motion.sigma_acel": [1.0]}}, "did you mean 'sigma_accel'"),
        ({"sweep": {"estimator.modes[0].motion.sigma_accel": [1.0]}}, "there is no list estimator.modes"),
        ({"sweep": {ACCEL: [1.0, -1.0]}}, "must be > 0, got -1"),
        ({"sweep": {ACCEL: []}}, "must be a list of at"),
        ({"trackers": {"a": 3}}, "trackers: must be a table"),
        ({"trackers": {"a": {"sensors.radar.sigma": -1}}, "sweep": {ACCEL: [1.0]}}, "trackers.a.sensors.radar.sigma: "),
        ({"trackers": {"a": {}}, "sweep": {ACCEL: [-1.0]}}, f"sweep.{ACCEL}: must be > 0"),
        ({"precision": {"position_rmsee": 1}}, "did you mean 'position_rmse'"),
        ({"precision": {"position_rmse": "1 kg"}}, "must be in m"),
        ({"precision": {"position_rmse": 0}}, "must be > 0"),
        ({"resume": True}, "needs the folder"),
        ({"scheduler": "tcp://127.0.0.1:1"}, "no Dask scheduler answers"),
    ],
)
def test_bad_input_is_told(options, said, monkeypatch):
    from vedette_study import executors

    if "scheduler" in options:
        pytest.importorskip("distributed")
        monkeypatch.setattr(executors, "PATIENCE", 0.5)
    with pytest.raises(vedette.ConfigError) as caught:
        vedette.monte_carlo(config(), **{"runs": 5} | options)
    assert said in str(caught.value)


def test_a_folder_of_another_study_is_refused(tmp_path):
    vedette.monte_carlo(config(), 4, 3, chunk=2, out=tmp_path)
    before = {path.name: path.read_bytes() for path in (tmp_path / "chunks").iterdir()}
    with pytest.raises(vedette.ConfigError, match="--resume continues"):
        vedette.monte_carlo(config(), 4, 3, chunk=2, out=tmp_path)
    for given, options in ((config(), {"seed": 4}), (config(), {"chunk": 3}), (config(clutter=False), {})):
        with pytest.raises(vedette.ConfigError, match="to go on, got"):
            vedette.monte_carlo(given, 4, **{"seed": 3, "chunk": 2} | options, out=tmp_path, resume=True)
    assert before == {path.name: path.read_bytes() for path in (tmp_path / "chunks").iterdir()}
    (tmp_path / "manifest.json").write_text("[")
    with pytest.raises(vedette.InputError, match=r"manifest\.json"):
        vedette.monte_carlo(config(), 4, 3, chunk=2, out=tmp_path, resume=True)


def test_a_study_may_be_extended(tmp_path):
    vedette.monte_carlo(config(), 25, 3, chunk=10, out=tmp_path)
    longer = vedette.monte_carlo(config(), 40, 3, chunk=10, out=tmp_path, resume=True)
    equal(longer, vedette.monte_carlo(config(), 40, 3, chunk=10))


@pytest.mark.costly
def test_a_full_disk_keeps_what_is_finished(tmp_path, undisturbed):
    path, out = write(tmp_path, chunk=10), tmp_path / "out"
    vedette.monte_carlo(config(), 20, 3, chunk=10, sweep=SWEEP, out=out)
    kept = sorted(each.name for each in (out / "chunks").iterdir())
    full = subprocess.run(
        [sys.executable, "-m", "vedette", "study", str(path), "--out", str(out), "--resume", "--threads", "1"],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500)),
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        check=False,
    )
    assert full.returncode == 2
    assert "File too large; the finished" in full.stderr
    assert "Traceback" not in full.stderr
    assert sorted(each.name for each in (out / "chunks").iterdir()) == kept
    equal(undisturbed, vedette.monte_carlo(config(), 60, 3, chunk=10, sweep=SWEEP, out=out, resume=True))


@pytest.mark.costly
def test_processes_end_with_the_one_that_asked_for_them():
    """Killed as a batch system kills, it leaves none behind that wait for work for ever."""
    code = (
        "import os, signal\nfrom vedette_study.executors import processes\n"
        "if __name__ == '__main__':\n"
        "    print(processes(2).submit(os.getpid).result(), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == -signal.SIGKILL, done.stderr
    status = Path(f"/proc/{int(done.stdout)}/status")
    for _ in range(500):
        if not status.exists() or "zombie" in status.read_text():
            return
        time.sleep(0.02)
    raise AssertionError("a process waits for one that is gone")
