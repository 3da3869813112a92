"""Which tracks are exported: all that were ever confirmed, those that lasted, or those that covered a true object."""

import csv
import json

import numpy as np
import pytest

from vedette.cli import main
from vedette_files import read_series, read_tracks


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run with a target and clutter so dense that a lifecycle in a hurry confirms some of it."""
    folder = tmp_path_factory.mktemp("chosen")
    looks = {"interval": 2.0, "clutter": {"x": {"low": -600, "high": 600}, "y": {"low": -600, "high": 600}}}
    ships = {"a": {"start": [0, 0], "speed": 8}}
    dense = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5, "clutter_density": 2e-5}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 8, "vy": 8}},
        "lifecycle": {"kind": "m_of_n", "hits": 2, "looks": 2},
        "source": {"kind": "simulation", "duration": 60, "looks": {"radar": looks}, "ships": ships},
    }
    (folder / "given.json").write_text(json.dumps(dense))
    assert main(["run", str(folder / "given.json"), "--out", str(folder), "--stream"]) == 0
    return folder


def exported(folder, tmp_path, *options):
    target = tmp_path / "tracks.csv"
    assert main(["export", str(folder), "--to", str(target), *options]) == 0
    with target.open() as file:
        return {int(row["track"]) for row in csv.DictReader(file)}


def lives(folder):
    """The time in s of each confirmed track from its confirmation on."""
    tracks = [each for each in read_tracks(folder / "tracks.jsonl") if each.confirmed.any()]
    return {each.id: each.times[-1] - each.times[np.argmax(each.confirmed)] for each in tracks}


@pytest.mark.costly
def test_all_that_were_ever_confirmed_and_no_tentative_ones(folder, tmp_path):
    assert exported(folder, tmp_path) == set(lives(folder))
    entries = read_series(folder / "series.npz")["entries"]
    assert len(set(entries["track"].tolist())) > len(lives(folder))


@pytest.mark.costly
def test_those_that_lasted(folder, tmp_path, capsys):
    wanted = {number for number, life in lives(folder).items() if life >= 20.0}
    assert 0 < len(wanted) < len(lives(folder))
    assert exported(folder, tmp_path, "--lasting", "20 s") == wanted
    assert f"{len(wanted)} of {len(lives(folder))} tracks" in capsys.readouterr().out


def test_those_that_covered_an_object(folder, tmp_path):
    entries = read_series(folder / "series.npz")["entries"]
    wanted = set(entries["track"][entries["object"] >= 0].tolist())
    assert 0 < len(wanted) < len(lives(folder))
    assert exported(folder, tmp_path, "--covering") == wanted


def test_what_cannot_be_chosen_is_told(folder, tmp_path, capsys):
    target = ["export", str(folder), "--to", str(tmp_path / "t.csv")]
    assert main([*target, "--lasting", "20 m"]) == 2
    assert "--lasting: must be in s" in capsys.readouterr().err
