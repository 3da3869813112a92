"""Named positions come back smoothed, in their columns: by object, whatever else is in the table."""

import numpy as np
import pandas as pd
import pytest

import vedette
from support.paths import recording
from support.reports import METRES, reports_frame
from vedette.errors import InputError
from vedette_tools.smoothing.cells import DEVIATIONS, GROSS, PIECE


def off(frame, true):
    """Return how far positions lie from the true ones, in m."""
    return np.linalg.norm(frame[["x", "y"]].to_numpy() - true, axis=1)


def test_positions_come_nearer_the_truth_with_deviations_that_say_how_near():
    frame, true = reports_frame()
    smooth = vedette.smooth_positions(frame)
    assert list(smooth.columns) == [*frame.columns, "speed_mps", "course_deg", *DEVIATIONS, PIECE, GROSS]
    assert smooth.index.equals(frame.index)
    assert smooth[["time", "id"]].equals(frame[["time", "id"]])
    assert not any(np.shares_memory(frame[title], smooth[title]) for title in ("time", "x", "y"))
    before, after = off(frame, true), off(smooth, true)
    assert np.sqrt(np.mean(after**2)) < 0.75 * np.sqrt(np.mean(before**2))
    assert 0.7 < np.mean(after**2 / (2 * smooth.position_deviation_m**2)) < 1.4


def test_gross_positions_are_marked_and_not_used():
    frame, true = reports_frame(seed=1)
    wrong = np.random.default_rng(2).choice(np.arange(50, len(frame) - 50), 20, replace=False)
    bad = frame.copy()
    bad.loc[wrong, "x"] += 3000.0
    smooth = vedette.smooth_positions(bad)
    assert smooth[GROSS].to_numpy()[wrong].all()
    assert smooth[GROSS].sum() <= len(wrong) + 3
    assert off(smooth, true)[wrong].max() < 60.0


def test_gross_positions_of_what_turns_about_are_marked():
    """Ten of 2 km of an animal whose velocity lasts 90 min, seen every 20: none is ten times as far off as those beside."""
    rng = np.random.default_rng(23)
    velocity, keeps = np.zeros((13_400, 2)), np.exp(-60.0 / 5400.0)
    for i in range(1, len(velocity)):
        velocity[i] = keeps * velocity[i - 1] + 0.6 * np.sqrt(1 - keeps**2) * rng.normal(size=2)
    true = np.cumsum(60.0 * velocity, axis=0)[::20]
    wrong = np.arange(10, len(true) - 10, 65)
    off = np.stack([np.cos(wrong), np.sin(wrong)], axis=-1) * 2000.0
    spots = true + rng.normal(0.0, 12.0, true.shape)
    spots[wrong] += off
    smooth = vedette.smooth_positions({"time": 1200.0 * np.arange(len(true)), "x": spots[:, 0], "y": spots[:, 1]})
    assert np.flatnonzero(smooth[GROSS]).tolist() == wrong.tolist()


def test_no_clean_position_is_gross_whatever_the_waits():
    """Where waits are unlike, the curve through those beside one magnifies their errors: 3.8 % were called gross."""
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.exponential(2.0, 200))
    spots = t[:, None, None] * rng.normal(0.0, 5.0, (20, 2)) + rng.normal(0.0, 5.0, (200, 20, 2))
    wrong = np.zeros((200, 20), dtype=bool)
    wrong[rng.integers(20, 180, 20), np.arange(20)] = True
    spots[wrong, 0] += 500.0
    x, y = spots.reshape(-1, 2).T
    smooth = vedette.smooth_positions({"time": np.repeat(t, 20), "id": np.tile(np.arange(20), 200), "x": x, "y": y}, by="id")
    assert np.flatnonzero(smooth[GROSS]).tolist() == np.flatnonzero(wrong).tolist()


@pytest.mark.costly
def test_an_object_is_smoothed_by_its_own_reports_alone():
    frame, _ = reports_frame(seed=3)
    shuffled = frame.sample(frac=1.0, random_state=0)
    smooth, again = vedette.smooth_positions(frame), vedette.smooth_positions(shuffled)
    assert again.index.equals(shuffled.index)
    pd.testing.assert_frame_equal(again.sort_index(), smooth)
    moved = frame.copy()
    other = frame.id == "ship 7"
    moved.loc[other, "x"] += 5e6
    apart = vedette.smooth_positions(moved)
    same = ~other.to_numpy()
    assert np.allclose(apart.loc[same, ["x", "y"]], smooth.loc[same, ["x", "y"]], atol=1e-6)


def test_long_gaps_split_a_path_and_nothing_is_made_up_in_them():
    frame, _ = reports_frame(seed=4, objects=2)
    frame.loc[frame.time > 600, "time"] += 7200.0
    smooth = vedette.smooth_positions(frame)
    assert set(smooth[PIECE]) == {0, 1}
    resampled = vedette.smooth_positions(frame, every="20 s")
    assert not ((resampled.time > 640) & (resampled.time < 7700)).any()
    assert np.all(resampled.time % 20 == 0)
    whole = vedette.smooth_positions(frame, gap="10 h")
    assert set(whole[PIECE]) == {0}


def test_resampled_positions_lie_where_the_objects_are():
    frame, true = reports_frame(seed=5)
    every = vedette.smooth_positions(frame, every=5.0)
    for name, rows in every.groupby("id"):
        own = (frame.id == name).to_numpy()
        at = np.stack([np.interp(rows.time, frame.time[own], true[own, axis]) for axis in (0, 1)], axis=1)
        assert np.sqrt(np.mean(np.sum((rows[["x", "y"]].to_numpy() - at) ** 2, axis=1))) < 12.0
    assert GROSS not in every


def test_rows_without_a_position_get_one_and_rows_without_a_name_go():
    frame, true = reports_frame(seed=6)
    frame.loc[[100, 200], "x"] = np.nan
    frame.loc[[5], "id"] = None
    frame.loc[[6], "time"] = np.nan
    smooth = vedette.smooth_positions(frame)
    assert len(smooth) == len(frame) - 2
    assert off(smooth.loc[[100, 200]], true[[100, 200]]).max() < 40.0


@pytest.mark.parametrize("middle", [0.0, 179.99])
def test_latitudes_are_smoothed_as_metres_are_across_the_date_line_too(middle):
    frame, _ = reports_frame(seed=7, objects=4)
    smooth = vedette.smooth_positions(frame)
    far = pd.DataFrame({"when": pd.to_datetime(frame.time, unit="s", utc=True), "mmsi": frame.id})
    far["lat"] = frame.y / METRES
    far["lon"] = (middle + frame.x / METRES + 180.0) % 360.0 - 180.0
    around = vedette.smooth_positions(far)
    assert around.lon.between(-180.0, 180.0).all()
    x = ((around.lon - middle + 180.0) % 360.0 - 180.0) * METRES
    assert np.hypot(x - smooth.x, around.lat * METRES - smooth.y).max() < 1.0
    assert np.median(np.abs(around.speed_mps - smooth.speed_mps)) < 0.05


def test_a_reported_speed_is_read_in_the_unit_that_fits_and_helps():
    frame, _ = reports_frame(seed=8)
    steady = vedette.smooth_positions(frame)
    told = frame.copy()
    told["sog"], told["cog"] = steady.speed_mps * 3600 / 1852, steady.course_deg
    again = vedette.smooth_positions(told)
    assert np.median(np.abs(again.sog * 1852 / 3600 - steady.speed_mps)) < 0.3
    assert again.speed_deviation_mps.mean() < steady.speed_deviation_mps.mean()


def test_what_cannot_be_smoothed_is_told():
    frame, _ = reports_frame()
    with pytest.raises(InputError, match="mmsi"):
        vedette.smooth_positions(frame, by="mmsi")
    with pytest.raises(InputError, match="every"):
        vedette.smooth_positions(frame, every="-3 s")
    with pytest.raises(InputError):
        vedette.smooth_positions(frame.assign(x=np.nan))
    with pytest.raises(InputError):
        vedette.smooth_positions(frame, every=1e-6)


@pytest.mark.costly
@pytest.mark.parametrize(
    ("names", "titles"),
    [
        (("solent_ais", "SolentAIS_20160112_130211.csv"), ("Time", "MMSI", "Latitude_degrees", "Longitude_degrees")),
        (("adsb", "area_20min.csv"), ("time_utc", "icao24", "latitude", "longitude")),
    ],
)
def test_recorded_reports_held_back_lie_nearer_than_to_lines_between_the_others(names, titles):
    time, name, *place = titles
    frame = pd.read_csv(recording(*names))
    frame = frame.sort_values([name, time], kind="stable").drop_duplicates([name, time]).reset_index(drop=True)
    own = frame[name].to_numpy()
    inner = np.concatenate([[False], (own[1:-1] == own[:-2]) & (own[1:-1] == own[2:]), [False]])
    held = inner & (np.random.default_rng(11).random(len(frame)) < 0.1)
    partly = frame.mask(pd.Series(held), other=np.nan)
    partly[[time, name]] = frame[[time, name]]
    true, when = frame[place].to_numpy(), pd.to_datetime(frame[time], format="ISO8601", utc=True).astype("int64").to_numpy()
    lines = np.zeros_like(true)
    for rows in frame.groupby(name).indices.values():
        kept = rows[~held[rows]]
        for axis in (0, 1):
            lines[rows, axis] = np.interp(when[rows], when[kept], true[kept, axis])
    scale = np.array([METRES, METRES * np.cos(np.radians(true[:, 0].mean()))])
    smooth = vedette.smooth_positions(partly)[place].to_numpy()
    mine, line = (np.linalg.norm((each - true) * scale, axis=1)[held] for each in (smooth, lines))
    assert np.mean(mine) < 0.95 * np.mean(line)
    assert np.percentile(mine, 90) < 0.95 * np.percentile(line, 90)


def test_no_deviation_is_below_what_the_digits_of_its_own_object_leave():
    """Minutes of four and of two digits, written as degrees: likelihood took these for exact to .4 mm."""
    rng, rows, steps = np.random.default_rng(8), [], {"moored": 1e-4, "fine": 1e-4, "coarse": 1e-2}
    for name, step in steps.items():
        speed = 0.0 if name == "moored" else 5.0
        lat = 50 + (speed * 10.0 * np.arange(120) + rng.normal(0, 0.5, 120) * (speed > 0)) / METRES
        minutes = np.floor(np.stack([60 * lat, 60 * (lat - 51)]) / step) * step
        lat, lon = np.round(minutes / 60, 14)
        rows.append(pd.DataFrame({"time": 10.0 * np.arange(120), "mmsi": name, "lat": lat, "lon": lon}))
    deviation = vedette.smooth_positions(pd.concat(rows, ignore_index=True)).groupby("mmsi").position_deviation_m
    for name, step in steps.items():
        assert deviation.min()[name] > 0.95 * step / 60 * METRES / np.sqrt(12)
    assert deviation.max()["fine"] < 2.0


def test_digits_that_are_cut_bound_what_is_claimed():
    """Buses at their stops repeat the digits of their positions: likelihood alone took these for errors of .4 mm."""
    rng, rows = np.random.default_rng(5), []
    for bus in range(4):
        place = np.repeat(np.cumsum(rng.normal(0, 300, (10, 2)), axis=0), 12, axis=0)  # two minutes at each of ten stops
        rows.append(pd.DataFrame({"time": 10.0 * np.arange(120), "id": f"bus {bus}", "x": place[:, 0], "y": place[:, 1]}))
    frame = pd.concat(rows, ignore_index=True)
    for digits in (1, 0):
        smooth = vedette.smooth_positions(frame.round({"x": digits, "y": digits}))
        at_rest = smooth.position_deviation_m.quantile(0.1)
        assert at_rest > 0.1 * 10.0**-digits / np.sqrt(12)
        assert at_rest < 10.0**-digits


def test_a_coordinate_that_never_changes_tells_no_digits():
    """Along a meridian of whole degrees: its one digit counted as an error of 32 km, and drew positions 2 km off."""
    time = 10.0 * np.arange(100)
    north = 5.0 * time + np.random.default_rng(0).normal(0, 5, 100)
    frame = pd.DataFrame({"time": time, "id": "a", "latitude": (59.0 + north / 111_200).round(6), "longitude": 10.0})
    smooth = vedette.smooth_positions(frame)
    assert np.abs(smooth.latitude - frame.latitude).max() * 111_200 < 20.0
    assert smooth.position_deviation_m.max() < 10.0


def test_reports_received_twice_change_nothing():
    frame, _ = reports_frame(seed=9, objects=4)
    twice = pd.concat([frame, frame.iloc[::3]], ignore_index=True)
    once, again = vedette.smooth_positions(frame), vedette.smooth_positions(twice)
    np.testing.assert_allclose(again[["x", "y", DEVIATIONS[0]]][: len(frame)], once[["x", "y", DEVIATIONS[0]]], atol=1e-6)
    assert not again[GROSS].any()


def test_an_object_that_is_all_at_once_elsewhere_goes_on_there_in_a_new_piece():
    frame, true = reports_frame(seed=10, objects=3)
    own = np.flatnonzero(frame.id == frame.id[0])
    later = own[len(own) // 2 :]
    frame.loc[later, "x"] += 5e4
    true[later, 0] += 5e4
    smooth = vedette.smooth_positions(frame)
    assert off(smooth, true).max() < 60.0
    assert set(smooth[PIECE][own]) == {0, 1}
    assert set(smooth[PIECE].drop(own)) == {0}
    assert smooth[PIECE][later[0]] != smooth[PIECE][later[0] - 1]


def test_nothing_is_claimed_where_no_report_tells():
    frame, _ = reports_frame(seed=11, objects=3)
    one = frame.id == frame.id[0]
    smooth = vedette.smooth_positions(frame.assign(x=frame.x.mask(one)))
    assert smooth.loc[one, ["x", "y", "speed_mps", DEVIATIONS[0]]].isna().all(axis=None)
    assert not smooth.loc[~one, ["x", "y"]].isna().any(axis=None)
    two = vedette.smooth_positions(frame.groupby("id").head(2))
    assert two[list(DEVIATIONS)].isna().all(axis=None)
    assert np.hypot(two.x - frame.x[two.index], two.y - frame.y[two.index]).max() < 1.0


def test_a_position_that_is_asked_for_within_a_gap_lies_between_the_reports_and_is_less_sure():
    frame, _ = reports_frame(seed=12, objects=2)
    asks = frame.groupby("id").head(1).assign(x=np.nan, time=600.0 + 1800.0)
    frame.loc[frame.time > 600, "time"] += 3600.0
    smooth = vedette.smooth_positions(pd.concat([frame, asks], ignore_index=True))
    asked = smooth.iloc[len(frame) :]
    assert np.isfinite(asked.x).all()
    assert asked[DEVIATIONS[0]].min() > 5 * smooth[DEVIATIONS[0]].median()
    for name, x in zip(asked.id, asked.x, strict=True):
        own = frame[frame.id == name].sort_values("time")
        before, after = own[own.time < 2400].x.iloc[-1], own[own.time > 2400].x.iloc[0]
        assert min(before, after) - 2000 < x < max(before, after) + 2000


@pytest.mark.parametrize("repeats", [True, False], ids=["times repeat", "each once at a time, many at each"])
def test_a_plain_id_names_objects_unless_it_counts_rows(repeats):
    frame, _ = reports_frame(seed=13, objects=6)
    single = frame[frame.id == frame.id[0]].assign(id=lambda own: np.arange(len(own)))
    if repeats:
        frame = pd.concat([frame, frame.assign(x=frame.x + 3.0)], ignore_index=True)
    else:
        frame = frame[frame.time < 40].sort_values("time", kind="stable")
    by = vedette.smooth_positions(frame, by="id")
    pd.testing.assert_frame_equal(vedette.smooth_positions(frame), by)
    counted, plain = vedette.smooth_positions(single), vedette.smooth_positions(single.drop(columns="id"))
    pd.testing.assert_frame_equal(counted[["x", "y"]], plain[["x", "y"]])


def drawn_objects(rng, count, spread, step, noise, *, in_turn):
    """The reports of some objects on their own courses, all at each of 300 times, or one at a time in any order."""
    paces = rng.normal(0.0, step, (count, 2))
    spots = rng.uniform(-spread, spread, (count, 2)) + np.arange(300.0)[:, None, None] * paces
    times = np.arange(300.0)[:, None] + (rng.random((300, count)) if in_turn else np.zeros((300, count)))
    spots += rng.normal(0.0, noise, spots.shape)
    who = np.tile(np.arange(count), (300, 1))
    frame = pd.DataFrame({"time": times.ravel(), "who": who.ravel(), "x": spots[..., 0].ravel(), "y": spots[..., 1].ravel()})
    return frame.sample(frac=1, random_state=0).sort_values("time", kind="stable").reset_index(drop=True)


@pytest.mark.parametrize("in_turn", [False, True], ids=["scans", "in turn"])
@pytest.mark.parametrize("count", [2, 5, 70])
@pytest.mark.by_turns
def test_several_objects_that_no_column_names_are_no_path_of_one(count, in_turn):
    """One path through all of them would be wild, and said to be sure."""
    frame = drawn_objects(np.random.default_rng(count), count, 1000.0, 1.0, 1.0, in_turn=in_turn)
    for given, by in ((frame, None), (frame.assign(kind="ship"), "kind")):
        with pytest.raises(vedette.InputError, match=r"COLUMN|by='who'"):
            vedette.smooth_positions(given, by=by)
    assert len(vedette.smooth_positions(frame, by="who")) == len(frame)


@pytest.mark.parametrize("what", ["stands", "digits", "two receivers", "gross", "wanders", "turns", "waits"])
def test_the_reports_of_one_object_are_one_path(what):
    rng, times = np.random.default_rng(5), np.arange(600.0)
    spots = np.cumsum(np.cumsum(rng.normal(0.0, 0.3, (600, 2)), axis=0), axis=0)
    if what == "turns":
        spots = 300.0 * np.stack([np.cos(times / 1.55), np.sin(times / 1.55)], axis=-1)
    if what == "waits":
        spots = 10.0 * np.cumsum(rng.random((600, 2)) < 0.2, axis=0)
    if what in ("stands", "digits"):
        spots = np.zeros((600, 2))
    if what == "two receivers":
        times, spots = np.repeat(times[:300], 2), np.repeat(spots[:300], 2, axis=0)
    noise = rng.normal(0.0, 3.0, (600, 2))
    if what == "wanders":
        noise = np.cumsum(0.2 * noise, axis=0)
    if what == "gross":
        noise[::5] += rng.normal(0.0, 3000.0, (120, 2))
    spots = np.round(spots + 0.1 * noise) if what == "digits" else spots + noise
    smooth = vedette.smooth_positions({"time": times, "x": spots[:, 0], "y": spots[:, 1]})
    assert smooth[DEVIATIONS[0]].notna().all()
