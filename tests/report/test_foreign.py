"""Estimates of a filter that Vedette does not run are judged as its own, of arrays and of a CSV; what is wrong is told."""

import json

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import InputError
from vedette.cli import main
from vedette_report.recorded import of_estimates, of_table, recorded
from vedette_report.recorded.credibility import noncredibility
from vedette_report.recorded.used import entries_of

MOVES = {"kind": "constant_velocity", "sigma_accel": 1.0}
START = {"x": [0, 20], "y": [0, 20], "vx": [12, 2], "vy": [0, 2]}
AXES = ("x", "y", "vx", "vy")


@pytest.fixture(scope="module", params=[1.0, 0.2], ids=["right", "Q too small"])
def ran(request):
    """A filter of Vedette's own: what it says, and the arrays that another program would have of it."""
    experiment = vedette.load(
        {
            "seed": 3,
            "gate": "off",
            "source": {
                "kind": "simulation", "duration": 300, "looks": {"radar": {"interval": 1.0}},
                "drawn": {"boat": {"models": [MOVES], "start": START}},
            },
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9}},
            "estimator": {"kind": "kalman", "motion": MOVES | {"sigma_accel": request.param}},
            "associator": {"kind": "nearest"},
            "birth": {"kind": "given", "start": START},
            "lifecycle": {"kind": "single_target"},
        }
    )  # fmt: skip
    result = experiment.run(keep_states=True)
    (own,) = recorded(experiment, result, ())
    (track,), (path,), (entries,) = result.tracks, result.recording.truth, entries_of(experiment.tracker, result).values()
    v, S = np.full((len(track.times), 2), np.nan), np.full((len(track.times), 2, 2), np.nan)
    for i, entry in enumerate(entries, start=1):
        if entry[3] > 0:
            v[i], S[i] = entry[5], entry[6]
    truth = np.array([path.at(time) for time in track.times.tolist()])
    return own, (track.space, track.times, track.mean, track.cov, truth, v, S)


def written(path, arrays, order=None, changed=None):
    """Write a CSV of estimates of several tracks, alike, rows in an order; with titles changed."""
    _, times, mean, cov, truth, v, S = arrays
    pairs, planar = [(i, j) for i in range(4) for j in range(i, 4)], [(0, 0), (0, 1), (1, 1)]
    columns = {"time": times} | {name: mean[:, i] for i, name in enumerate(AXES)}
    columns |= {f"cov_{AXES[j]}_{AXES[i]}": cov[:, i, j] for i, j in pairs}
    columns |= {f"true_{name}": truth[:, i] for i, name in enumerate(AXES)}
    columns |= {f"nu_{name}": v[:, i] for i, name in enumerate("xy")}
    columns |= {f"S_{'xy'[i]}_{'xy'[j]}": S[:, i, j] for i, j in planar}
    columns = changed(columns) if changed else columns
    rows = np.column_stack([*columns.values()])
    rows = rows if order is None else rows[order]
    lines = [",".join("" if np.isnan(cell) else repr(cell) for cell in row.tolist()) for row in rows]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return path


def same(one, own):
    """The same figures and hint, but for what is not known of another program: its P_D, names, and returns."""
    ours, theirs = own.data(), one.data()
    for name in ("scans", "anees", "nis", "whiteness", "noncredibility_db", "inclination_db"):
        assert theirs[name] == pytest.approx(ours[name], rel=1e-9)
    assert one.hint == evolve(own, off=()).hint
    return True


def test_arrays_are_judged_as_vedettes_own_filter_is(ran):
    own, arrays = ran
    assert same(of_estimates(*arrays), own)


def test_a_table_is_judged_as_vedettes_own_filter_is_whatever_the_order_of_its_rows(ran, tmp_path):
    own, arrays = ran
    order = np.random.default_rng(1).permutation(len(arrays[1]))
    (told,) = of_table(written(tmp_path / "mine.csv", arrays, order))
    assert same(told, own)


def test_the_command_takes_it(ran, tmp_path, capsys):
    own, arrays = ran
    path = written(tmp_path / "mine.csv", arrays)
    assert main(["consistency", str(path), "--out", str(tmp_path / "out"), "--json"]) == 0
    *lines, data = capsys.readouterr().out.splitlines()
    (track,) = json.loads(data)["tracks"]
    assert track["anees"] == pytest.approx(own.anees)
    assert (tmp_path / "out/consistency.txt").read_text().splitlines() == lines[:-1]
    assert main(["consistency", str(path), "--set", "gate=off"]) == 2
    assert "--set" in capsys.readouterr().err


def test_either_truth_or_innovations_are_enough(ran):
    own, (space, times, mean, cov, truth, v, S) = ran
    assert of_estimates(space, times, mean, cov, truth).anees == pytest.approx(own.anees)
    blind = of_estimates(space, times, mean, cov, None, v, S)
    assert (blind.anees, blind.nis) == (None, pytest.approx(own.nis))
    half = np.where(np.arange(len(times))[:, None] < 100, np.nan, truth)
    half[:, 2:] = np.nan
    assert of_estimates(space, times, mean, cov, half).scans == len(times) - 100
    with pytest.raises(InputError, match="truth"):
        of_estimates(space, times, mean, cov)


def test_a_table_with_truth_alone_is_judged(ran, tmp_path):
    """It was refused with a traceback, as an array of no innovations had no shape."""
    own, arrays = ran
    (told,) = of_table(written(tmp_path / "mine.csv", arrays, changed=without_innovations))
    assert (told.anees, told.nis) == (pytest.approx(own.anees), None)


def test_a_track_of_too_few_rows_is_left_out(tmp_path):
    """It took the whole table with it."""
    path, rows = tmp_path / "mine.csv", "".join(f"{k},1,{k % 3 - 1},1,0\n" for k in range(9))
    path.write_text(f"time,track,x,cov_x_x,true_x\n{rows}3,2,0,1,0\n")
    assert [told.track for told in of_table(path)] == [1]
    path.write_text("time,track,x,cov_x_x,true_x\n3,2,0,1,0\n")
    with pytest.raises(InputError, match="one track"):
        of_table(path)


def test_arrays_that_are_none_are_told(ran):
    _, (space, times, mean, cov, truth, v, S) = ran
    with pytest.raises(InputError, match=r"track 0: .* rows"):
        of_estimates(space, times[:0], mean[:0], cov[:0], truth[:0])
    lopsided = np.triu(np.ones((4, 4)))
    with pytest.raises(InputError, match=r"estimate .*symmetric"):
        of_estimates(space, times, mean, cov * lopsided, truth)
    with pytest.raises(InputError, match=r"innovation .*symmetric"):
        of_estimates(space, times, mean, cov, truth, v, S + np.array([[0.0, 1.0], [0.0, 0.0]]))


def without_innovations(columns):
    return {name: values for name, values in columns.items() if not name.startswith(("nu_", "S_"))}


def dropped(title):
    return lambda columns: {name: values for name, values in columns.items() if name != title}


def spoilt(title, value):
    return lambda columns: {name: np.where(name == title, value, values) for name, values in columns.items()}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (dropped("cov_vx_x"), "no column cov_x_vx"),
        (dropped("S_x_y"), "no column S_x_y"),
        (dropped("time"), "columns must be time"),
        (spoilt("cov_x_x", -4.0), "positive definite"),
        (spoilt("x", np.nan), "lacks numbers"),
        (spoilt("S_x_x", np.nan), "lacks numbers"),
    ],
)
def test_what_is_wrong_is_told(ran, tmp_path, changed, said):
    with pytest.raises(InputError, match=said):
        of_table(written(tmp_path / "mine.csv", ran[1], changed=changed))


def test_a_cell_that_is_no_number_is_told_with_its_line(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("time,x,cov_x_x\n0,1,2\n1,one,2\n")
    with pytest.raises(InputError, match=r"mine\.csv:3: x"):
        of_table(path)


def test_an_exact_estimate_tells_nothing_of_credibility():
    """It made both indices NaN."""
    error = np.array([[1.0], [0.0], [-1.0], [1.0]])
    assert noncredibility(error, np.full((4, 1, 1), 4.0)).inclination == pytest.approx(-10 * np.log10(4 / 0.75))
