"""An object's own reports decide for it: without the others of a table it moves by less than what it claims to know."""

import numpy as np
import pandas as pd
import pytest

import vedette
from support.paths import recording
from vedette_tools.smoothing import noises
from vedette_tools.smoothing.cells import DEVIATIONS

CLAIMED = ((0, 5.0), (10, 3.0), (100, 2.0))
"""From so many rows on, an object moves by less than so many deviations: of 26 drawn fleets by 3.9, 2.2 and 1.5 at most."""


def fleet(seed, rows=(5, 12, 30, 80, 200), objects=12):
    """Objects of few and many rows, a third of them at rest, each with a noise of its own; two reports in 100 are gross."""
    rng, parts = np.random.default_rng(seed), []
    for k in range(objects):
        n, sigma, agility = rng.choice(rows), 10 ** rng.uniform(-0.5, 1.5), 0.0 if k % 3 == 0 else 10 ** rng.uniform(-2, 0.3)
        waits = rng.exponential(rng.choice([2.0, 10.0, 60.0]), n)[:, None]
        paces = np.cumsum(agility * np.sqrt(waits) * rng.normal(0, 1, (n, 2)), axis=0) + rng.normal(0, 8.0 * (k % 3 > 0), 2)
        spots = np.cumsum(paces * waits, axis=0) + rng.normal(0, sigma * np.where(rng.random((n, 1)) < 0.02, 30, 1), (n, 2))
        parts.append(pd.DataFrame({"time": np.cumsum(waits), "id": f"{k:02}", "x": spots[:, 0], "y": spots[:, 1]}))
    return pd.concat(parts, ignore_index=True)


def moved(frame, place, size, share):
    """Return of each row by how many deviations it moves where a share of the others is dropped, and its object's rows."""
    whole, name, (first, second) = vedette.smooth_positions(frame, by="id"), frame["id"], place
    far, rng = np.full(len(frame), np.nan), np.random.default_rng(0)
    for one in name.unique():
        kept = (name == one) | name.isin([other for other in name.unique() if rng.random() >= share])
        alone = vedette.smooth_positions(frame[kept].reset_index(drop=True), by="id")
        mine, own = whole[name == one], alone[alone["id"] == one]
        off = [(mine[title].to_numpy() - own[title].to_numpy()) * size for title in (first, second)]
        narrowed = np.cos(np.radians(mine[second].mean())) if size > 1 else 1.0
        far[(name == one).to_numpy()] = np.hypot(off[0] * narrowed, off[1]) / mine[DEVIATIONS[0]].to_numpy()
    return far, name.map(name.value_counts()).to_numpy()


@pytest.mark.parametrize(("seed", "share"), [(2, 1.0), (3, 0.7)], ids=["alone", "a third"])
@pytest.mark.by_turns
def test_without_others_an_object_stays_within_what_it_claims(seed, share, monkeypatch):
    """One model of all moved gross rows by 70 deviations; the mutant takes an object's likeliest errors by a sharp prior."""
    frame, weights = fleet(seed), noises.Trials.weights

    def likeliest(trials, model):
        found = weights(trials, noises.Model(model.common**20))
        return (np.maximum.reduceat(found, np.unique(trials.whose, return_index=True)[1])[trials.whose] == found) * 1.0

    far, rows = moved(frame, ("x", "y"), 1.0, share)
    for least, most in CLAIMED:
        assert np.nanmax(far[rows >= least], initial=0.0) < most, least
    monkeypatch.setattr(noises.Trials, "weights", likeliest)
    far, _ = moved(frame, ("x", "y"), 1.0, share)
    assert np.nanmax(far) > CLAIMED[0][1]


@pytest.mark.costly
def test_of_recorded_ships_those_at_berth_do_not_decide_for_those_under_way():
    """By up to 18 deviations and 18 m."""
    frame = pd.read_csv(recording("solent_ais", "SolentAIS_20160112_130211.csv"))
    frame = frame.rename(columns={"MMSI": "id", "Longitude_degrees": "longitude", "Latitude_degrees": "latitude"})
    frame = frame[frame["id"].isin(np.unique(frame["id"])[::8])].drop_duplicates(["id", "Time"]).reset_index(drop=True)
    far, _ = moved(frame, ("longitude", "latitude"), 111_195.0, 1.0)
    assert np.nanmax(far) < 1.0
