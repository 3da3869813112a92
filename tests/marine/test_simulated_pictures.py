"""Boats and a ship tracked from simulated radar pictures."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.radar_pictures import judged
from vedette_marine import outcome, picture_runs
from vedette_marine import reproduction as study


# Simulated pictures.
def quietly(items, about):
    return items


def short(name, frames, **more):
    """A scene's first frames."""
    from vedette_marine.reproduction import SCENES

    scene = SCENES[name]() | {"frames": frames, "lost": frames // 20} | more
    return {name: lambda: scene}


def tracked_from_pictures(name, runs, seed):
    """Each target's records by filter, tracked from the scene's pictures. Their figures are printed: pytest -rP."""
    points = picture_runs.seen(name, runs, seed, quietly)
    presets, found = study.TUNED[name], {}
    for k, target in enumerate(points.names):
        found[target] = {each: study.record(name, points, k, presets[each], study.SIGMA[name]) for each in outcome.FILTERS}
    rows = {(target, "tuned"): records for target, records in found.items()}
    for table in (outcome.error_table(name, "tuned", rows, "RMSE in m"), outcome.ratio_table(rows)):
        for label, cells in table.rows:
            print(
                label,
                *(f"{c}: {v.measured or 0:.4g} +- {v.error or 0:.2g}" for c, v in zip(table.columns, cells, strict=True)),
            )
    return found


@pytest.mark.costly
def test_boats_are_tracked_from_simulated_pictures(pytestconfig, monkeypatch):
    """Against AIS at most 12 m in the mean of two runs of the whole scene and none lost, at night; IMM-PDAF errs least.

    Else one run of 20 s, in which the error of the AIS itself and of the start do not average out: at most 20 m.
    """
    night = pytestconfig.getoption("vedette_profile") == "nightly"
    if not night:
        monkeypatch.setattr(picture_runs, "SCENES", short("MANV-like", 30))
    for records in tracked_from_pictures("MANV-like", 2 if night else 1, 2026).values():
        assert not any(each.lost.any() for each in records.values())
        assert outcome.rms(records["IMM-PDAF"], "ais") <= (12.0 if night else 20.0)
        if night:
            assert outcome.ratio(records, "CV-PDAF", "ais").measured < 0.96


ROUGH = {"shape": 0.5, "level": 5.0, "seconds": 6.2}
"""A spiky sea, 4 dB above that of the scene: 80 false returns a picture instead of 3."""


@pytest.mark.nightly("two runs of pictures: 3 s")
def test_evidence_of_the_picture_keeps_spikes_from_becoming_tracks():
    """Tracks that start by themselves in a spiky sea: with brightness and size at most three quarters of the false ones."""
    overrides = ["source.frames=30", "source.lost=0", "source.buoys=[]", "sensors.radar.clutter_density=2e-6"]
    overrides += [f"source.sea.{name}={value}" for name, value in ROUGH.items()]
    config = vedette.to_config(vedette.load(EXAMPLES / "marine_picture.toml", overrides=overrides))
    config["judge"].pop("near")
    result, informed = judged(config)
    assert all(scan.detections.evidence is not None for scan in result.scans)
    config["preprocessors"]["radar"].pop("evidence")
    result, plain = judged(config)
    assert all(scan.detections.evidence is None for scan in result.scans)
    assert plain.false_tracks > 2
    assert informed.false_tracks < 0.75 * plain.false_tracks
    assert informed.coverage >= plain.coverage


@pytest.mark.nightly("a run of pictures: a minute of CPU")
def test_boats_are_kept_in_a_rough_sea(monkeypatch):
    """Announced boats, whose tracks need the gate alone, over a turn of both: no worse than in the scene's own sea."""
    monkeypatch.setattr(picture_runs, "SCENES", short("MANV-like", 400, sea=ROUGH))
    for records in tracked_from_pictures("MANV-like", 1, 2027).values():
        assert not any(each.lost.any() for each in records.values())
        assert outcome.rms(records["IMM-PDAF"], "ais") <= 12.0


@pytest.mark.nightly("a run of pictures: half a minute of CPU")
def test_the_large_ship_is_tracked_from_simulated_pictures(monkeypatch):
    """A beacon sends every 45 s. What is seen is the hull; the antenna that AIS tells of stands 65 m aft of its middle."""
    monkeypatch.setattr(picture_runs, "SCENES", short("DARC-like", 240))
    (records,) = tracked_from_pictures("DARC-like", 1, 2026).values()
    assert not any(each.lost.any() for each in records.values())
    assert outcome.rms(records["IMM-PDAF"], "centre") <= 15.0
    assert 40.0 < outcome.rms(records["IMM-PDAF"], "ais") < 90.0
    assert outcome.ratio(records, "CV-PDAF", "ais").measured == pytest.approx(1.0, abs=0.02)


@pytest.mark.nightly("a study of pictures: 9 s")
def test_the_study_from_pictures_says_all_and_a_run_is_the_same_among_others(monkeypatch):
    scenes = short("MANV-like", 20) | short("DARC-like", 20)
    monkeypatch.setattr(picture_runs, "SCENES", scenes)
    monkeypatch.setattr(picture_runs, "tuned", lambda scene, seed, number, keep: study.TUNED[scene])
    results = [picture_runs.MarinePicturesReproduction().run(runs, 3, quietly) for runs in (1, 2)]
    labels = {label for label, _ in results[0].tables[0].rows}
    assert labels == {"MANV-like boat 1", "MANV-like boat 2", "DARC-like ship"}
    alone, both = (result.charts[0].panels[0].curves[1] for result in results)
    np.testing.assert_array_equal(alone.x, both.x)  # the first run is the same however many follow
    assert len(results[0].claims) == 8
