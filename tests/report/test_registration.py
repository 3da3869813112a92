"""Offsets that all tracks share, through `vedette run` and studies, with every associator."""

import json

import numpy as np
import pytest

from support.registration import CLUTTER, RADAR, config
from vedette.cli import main
from vedette_study.plan import plan
from vedette_study.study import perform

KINDS = ("pda", "jpda", "jpda_star", "gnn", "nearest", "m_best_jpda", "lmb", "k_best", "n_scan", "variational")
OFF, PRIOR = float(np.radians(1.5)), 0.03


def turned(associator="jpda", shared=True):
    """The config of two radars for a minute, the second turned by 1.5 degrees; `shared`: all tracks estimate it."""
    other = {**RADAR, "x": 3000.0, "y": -500.0}
    biased = {"kind": "biased", "of": other, "add": {"bearing": "bearing_offset"}, "spread": {"bearing_offset": PRIOR}}
    wrong = {"kind": "displaced", "of": other, "add": {"bearing": OFF}}
    looks = {"a": {"interval": 2.5, "clutter": CLUTTER}, "b": {"interval": 3.0, "clutter": CLUTTER}}
    sensors, names = {"a": RADAR, "b": biased if shared else other}, ["bearing_offset"] if shared else []
    offsets = {"bearing_offset": PRIOR} if shared else {}
    made = config(sensors, looks, {"b": wrong}, offsets, names, associator, starters=["a"])
    made["source"]["duration"] = 60
    return made if shared else {name: part for name, part in made.items() if name != "registration"}


@pytest.mark.costly
@pytest.mark.parametrize("associator", KINDS)
def test_a_run_finds_the_offset_and_tells_of_it(associator, tmp_path, capsys):
    """Within 4.5 deviations: in some ten runs of a million not. The summary has estimate, deviation and what was removed."""
    (tmp_path / "config.json").write_text(json.dumps(turned(associator)))
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out"), "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out.splitlines()[-1])["registration"].items()
    name, found = told
    assert name == "bearing_offset"
    assert not found["refused"]
    assert found["deviation"] < 0.2 * PRIOR
    assert abs(found["estimate"] - OFF) < 4.5 * found["deviation"]
    (line,) = [line for line in (tmp_path / "out" / "summary.txt").read_text().splitlines() if "bearing_offset" in line]
    assert f"{found['estimate']:.3g}" in line
    assert "% removed" in line


@pytest.mark.costly
def test_a_study_of_every_associator_gains_by_it():
    """The mean error of each is below that of the same trackers which take both radars as right."""
    errors = {}
    for shared in (True, False):
        found = perform(plan({"experiment": turned(shared=shared), "runs": 2, "sweep": {"associator.kind": list(KINDS)}}))
        errors[shared] = [found.means(i)["position_rmse"].value for i in range(len(KINDS))]
    assert np.all(np.array(errors[True]) < 0.8 * np.array(errors[False]))
