"""Files that gave confident nonsense: a draft finds what is in them, or says first that nothing fits."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette_tools.drafting import seen
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.doubts import doubt
from vedette_tools.drafting.held import held_on_its_way
from vedette_tools.drafting.own_errors import roundings
from vedette_tools.drafting.reading import read
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.wishes import Wishes


def table(path, head, rows):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def sigma_of(path):
    (noise,) = read(read_table(path)).noise.values()
    return noise.sensor


@pytest.mark.costly
def test_what_lies_far_off_is_no_error_of_a_position(tmp_path):
    """A tenth of the fixes of one receiver, good to 2 m, is wrong by 3 km: errors of 57 m were drafted, and 1,400 m/s."""
    rng = np.random.default_rng(1)
    spots = np.cumsum([2.0, 1.0] + rng.normal(0, 0.2, (800, 2)), axis=0) + rng.normal(0, 2, (800, 2))
    spots[::10] += rng.normal(0, 3000, (80, 2))
    rows = [(i, *spot) for i, spot in enumerate(spots.round(2).tolist())]
    assert sigma_of(table(tmp_path / "d.csv", "time,x,y", rows)) == pytest.approx((2.0,), rel=0.1)


def test_rows_that_hold_a_report_leave_its_object_the_name(tmp_path):
    """State vectors of ADS-B at the times of their positions: each stands in two or three rows: icao24 was not read."""
    times = range(0, 600, 10)
    rows = [(t, f"4067f{i}", 46 + t // 25 / 100, 7 + i, 200 + t % 3, t // 25 * 25) for t in times for i in range(4)]
    path = table(tmp_path / "d.csv", "time,icao24,lat,lon,velocity,lastposupdate", rows)
    assert read_table(path, wishes=Wishes(time="lastposupdate")).identity == "icao24"


@pytest.mark.costly
@pytest.mark.parametrize(("every", "said"), [(3, True), (1, False)])
def test_positions_that_are_asked_for_before_they_change_are_told(every, said, tmp_path):
    """Buses report every 30 s and are asked every 10: errors of 53 m were drafted for those of 8 m, without a word."""
    rng = np.random.default_rng(4)
    paces = rng.normal(0, 6, (4, 2))
    spots = [[k * 10 * every * paces[i] + rng.normal(0, 8, 2) for k in range(40)] for i in range(4)]
    rows = [
        (10 * k, i, *(f"{each + 2000 * i:.1f}" for each in spots[i][k // every]))
        for k in range(40 * every)
        for i in range(4)
    ]
    text = drafted(table(tmp_path / "d.csv", "time,vehicle_id,x,y", rows)).text
    assert ("stands in some 3 rows" in text) == said


@pytest.mark.parametrize(("floor", "slope", "said"), [(0.03, 1.0, True), (12**-0.5, 1.0, False), (0.03, 0.0, False)])
def test_what_creeps_from_digit_to_digit_and_what_is_moored_is_not_asked_for_too_often(floor, slope, said):
    """`floor`: the error that digits leave; without a slope it goes to and fro."""
    along = np.repeat(np.arange(40.0) if slope else np.arange(40.0) % 2, 3)
    chain = SimpleNamespace(spots=np.stack([along, 0 * along], axis=-1))
    best = SimpleNamespace(seen={"s": SimpleNamespace(chains=[chain])}, table=SimpleNamespace(floors=(floor,)))
    assert bool(held_on_its_way(best)) == said


def test_the_errors_of_all_are_not_found_anew_for_each_object(tmp_path, monkeypatch):
    """5,000 objects were drafted for minutes: once an object, all were looked at."""
    plain, asked = seen.usual_bend, []
    monkeypatch.setattr(seen, "usual_bend", lambda chains: asked.append(chains) or plain(chains))
    counts = []
    for objects in (4, 40):
        rows = [(10 * k, i, 5000 * i + 30 * k + k % 3, 10 * k) for k in range(8) for i in range(objects)]
        read(read_table(table(tmp_path / "d.csv", "time,id,x,y", rows)))
        counts.append(len(asked))
    assert counts[1] == 2 * counts[0]


@pytest.mark.filterwarnings("error")
def test_no_warning_of_numpy_comes_before_what_is_said_of_a_header_without_rows(tmp_path):
    with pytest.raises(vedette.InputError, match="no rows"):
        drafted(table(tmp_path / "d.csv", "time,icao24,lat,lon", []))


@pytest.mark.parametrize(("digits", "step"), [(2, 1112.0), (3, 111.2)])
@pytest.mark.by_turns
def test_errors_are_no_smaller_than_digits_leave_them(digits, step, tmp_path):
    """Boats at 6 m/s stay in one hundredth of a degree for minutes: errors of 1 mm were drafted."""
    rng = np.random.default_rng(2)
    start, pace = rng.uniform(-5000, 5000, (5, 2)), rng.normal(0, 6, (5, 2))
    spots = [(10 * k, *(start[i] + 10 * k * pace[i]) / 111_195) for k in range(50) for i in range(5)]
    rows = [(t, f"{50 + north:.{digits}f}", f"{-1 + east:.{digits}f}") for t, north, east in spots]
    (sigma,) = sigma_of(table(tmp_path / "d.csv", "time,lat,lon", rows))
    assert step / 12**0.5 * 0.999 < sigma < step


def test_digits_tell_errors_in_any_unit():
    cells = {"range": ["1.25", "3"], "bearing": ["12.5"], "x": ["3"], "latitude": ["1e-3", "2"]}
    found = roundings(cells, {"range": "km", "bearing": "deg", "x": "px"})
    told = {"range": 10.0, "bearing": np.radians(0.1), "x": 1.0, "latitude": 0.0}
    assert found == pytest.approx({axis: step / 12**0.5 for axis, step in told.items()})


@pytest.mark.parametrize(
    ("clock", "told"),
    [
        (lambda t: f"2026-10-25 02:{(50 + t // 60) % 60:02d}:{t % 60:02d}", "no clock was set back"),
        (
            lambda t: f"2026-03-29 0{1 + (t >= 600) + (50 + t // 60) // 60}:{(50 + t // 60) % 60:02d}:{t % 60:02d}",
            "lack the hour",
        ),
        (lambda t: f"{23 + (t >= 600)}:{(50 + t // 60) % 60:02d}:{t % 60:02d}", "180 of 360 rows cannot be read"),
    ],
    ids=["an hour twice", "no hour", "past 24:00:00"],
)
@pytest.mark.costly
def test_a_draft_says_what_of_the_times_it_does_not_take_as_they_stand(clock, told, tmp_path):
    """Where summer time ended three targets became six, and past 24:00:00 every row was refused, without a word."""
    rng = np.random.default_rng(4)
    start, pace = rng.uniform(-3000, 3000, (3, 2)), rng.normal(0, 6, (3, 2))
    spots = [(10 * k, *(start[i] + 10 * k * pace[i] + rng.normal(0, 5, 2)).round(1)) for k in range(120) for i in range(3)]
    rows = [(clock(t), x, y) for t, x, y in spots]
    text = drafted(table(tmp_path / "d.csv", "time,x,y", rows)).text
    assert told in text


def in_minutes(degrees):
    whole, rest = divmod(degrees, 1)
    return f"{whole:.0f} {60 * rest:.5f} N"


def in_seconds(degrees):
    minutes, rest = divmod(60 * degrees, 1)
    return f"{minutes // 60:.0f}°{minutes % 60:.0f}'{60 * rest:.3f}\"N"


@pytest.mark.parametrize("written", [in_minutes, in_seconds])
@pytest.mark.costly
def test_errors_are_the_same_however_degrees_are_written(written, tmp_path):
    """Cells that are no plain number were taken for whole degrees: errors of 32 km were drafted for 5 m."""
    rng = np.random.default_rng(3)
    start, pace = rng.uniform(-3000, 3000, (3, 2)), rng.normal(0, 6, (3, 2))
    spots = [(10 * k, *(start[i] + 10 * k * pace[i] + rng.normal(0, 5, 2)) / 111_195) for k in range(40) for i in range(3)]
    found = [
        sigma_of(table(tmp_path / "d.csv", "time,lat,lon", [(t, form(55.5 + y), form(12.5 + x)) for t, y, x in spots]))
        for form in ("{:.8f}".format, written)
    ]
    assert found[0] == pytest.approx(found[1], rel=0.02)
    assert found[0] == pytest.approx((5.0,), rel=0.3)


TRACKER = """
[sensors.sensor]
kind = "cartesian_position"
sigma = 10.0
detection_probability = 0.9
clutter_density = 1e-12
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = SIGMA_ACCEL }
[associator]
kind = "jpda"
[birth]
kind = "from_returns"
spread = { vx = 20.0, vy = 20.0 }
[lifecycle]
kind = "existence"
"""


def scans_of(places):
    """Scans 10 s apart of places (s, k, 2)."""
    return [vedette.Scan(10.0 * k, "sensor", vedette.Detections.of(each)) for k, each in enumerate(places)]


def moving(objects, seed, side=2000.0):
    """Where objects that go straight are detected in 60 scans, to 10 m."""
    rng = np.random.default_rng(seed)
    start, pace = rng.uniform(-side, side, (objects, 2)), rng.normal(0, 3, (objects, 2))
    return start + 10 * np.arange(60)[:, None, None] * pace + rng.normal(0, 10, (60, objects, 2))


def test_tracks_of_targets_are_believed_and_those_of_anything_are_not():
    assert doubt(TRACKER.replace("SIGMA_ACCEL", "0.1"), scans_of(moving(6, 3))) == ""
    # as good as any position is within the gate of what accelerates so
    anywhere = np.random.default_rng(4).uniform(-2000, 2000, (60, 6, 2))
    assert doubt(TRACKER.replace("SIGMA_ACCEL", "60"), scans_of(anywhere))


@pytest.mark.parametrize("error", [0.0, 10.0])
def test_objects_that_are_reported_twice_are_told(error):
    """By two receivers, or by rows that stand twice: each object had two tracks, at one place."""
    once = moving(5, 5)
    twice = np.concatenate([once, once + np.random.default_rng(6).normal(0, error, once.shape)], axis=1)
    assert "share the same returns" in doubt(TRACKER.replace("SIGMA_ACCEL", "0.1"), scans_of(twice))
    beside = np.concatenate([once, once + [40.0, 0.0]], axis=1)
    assert doubt(TRACKER.replace("SIGMA_ACCEL", "0.1"), scans_of(beside)) == ""


def test_returns_are_the_same_where_several_scans_share_a_time():
    """Two sensors look at one moment, in one order ahead and in the other backwards."""
    scans = [
        evolve(scan, detections=vedette.Detections.of(scan.detections.z[i::2]))
        for scan in scans_of(moving(6, 7))
        for i in (0, 1)
    ]
    assert doubt(TRACKER.replace("SIGMA_ACCEL", "0.1").replace("0.9\n", "0.5\n"), scans) == ""


@pytest.mark.costly
@pytest.mark.parametrize(("minutes", "told"), [(2, ""), (5, "backwards")])
def test_boats_that_report_too_seldom_are_not_told_apart(minutes, told, tmp_path):
    """Without names, at whole minutes: 517 tracks were drafted of some boats, a sixth of the pairs of two of them."""
    rng, rows = np.random.default_rng(8), []
    for spot in rng.normal(0, 4000, (20, 2)):
        time, course = rng.uniform(0, 60 * minutes), rng.uniform(0, 2 * np.pi)
        while time < 36_000:
            rows.append((60 * round(time / 60), *(spot + rng.normal(0, 8, 2)).round(1).tolist()))
            wait = 60 * minutes * rng.uniform(0.6, 1.6)
            course = course + rng.normal(0, 0.02 * np.sqrt(wait)) if np.hypot(*spot) < 9000 else np.arctan2(*-spot[::-1])
            spot, time = spot + 3.0 * wait * np.array([np.cos(course), np.sin(course)]), time + wait
    assert told in (failure := drafted(table(tmp_path / "d.csv", "time,x,y", sorted(rows))).failure)
    assert bool(told) == bool(failure)


@pytest.mark.costly
def test_what_is_faster_than_anything_is_in_another_unit(tmp_path):
    """Millimetres, taken as metres: 8 km/s."""
    rows = [(10 * k, *spot) for k, each in enumerate((1000 * moving(3, 9)).round().astype(int).tolist()) for spot in each]
    failure = drafted(table(tmp_path / "d.csv", "time,x,y", rows)).failure
    assert "x=0.001" in failure
    assert not drafted(tmp_path / "d.csv", wishes=Wishes(units={"x": "0.001 m", "y": "0.001 m"})).failure


@pytest.mark.costly
def test_what_is_seen_every_six_hours_is_tracked(tmp_path):
    """A storm, to a quarter of a degree: targets were taken to stay for ten minutes, and no track was confirmed."""
    rows = [(f"2026-05-{1 + k // 4:02d} {6 * (k % 4):02d}:00", 20 + round(0.8 * k) / 4, -40 - k / 4) for k in range(40)]
    draft = drafted(table(tmp_path / "d.csv", "time,lat,lon", rows))
    assert not draft.failure
    assert vedette.load(tomllib.loads(draft.text)).run().score().tracks == 1


@pytest.mark.costly
def test_a_draft_is_the_same_at_any_scale(tmp_path):
    """Of cells, in micrometres: speeds of 1 mm/s and errors of 1 mm were the least, and no track was confirmed."""
    rows = [(10 * k, *spot) for k, each in enumerate(moving(3, 9).round(3).tolist()) for spot in each]
    found = []
    for unit in ("m", "um"):
        text = drafted(table(tmp_path / f"{unit}.csv", f"time,x ({unit}),y ({unit})", rows)).text
        config = tomllib.loads(text)
        assert vedette.load(config).run().score().tracks == 3
        found.append([config["sensors"]["sensor"]["sigma"], *config["birth"]["spread"].values()])
    assert found[0] == pytest.approx([1e6 * each for each in found[1]], rel=0.05)


@pytest.mark.costly
def test_what_is_named_is_one_track_over_its_gaps(tmp_path):
    """As of an animal, whose receiver sleeps: each of two was ten tracks, for a target stays in view ten minutes."""
    rng, rows = np.random.default_rng(10), []
    for name in "ab":
        spot, pace = rng.uniform(-3000, 3000, 2), rng.normal(0, 0.1, 2)
        for day in range(6):
            rows += [
                (86_400 * day + t, name, *(spot + t * pace + rng.normal(0, 10, 2)).round(1)) for t in range(0, 3600, 300)
            ]
            spot, pace = spot + 3600 * pace + rng.normal(0, 2000, 2), rng.normal(0, 0.1, 2)
    draft = drafted(table(tmp_path / "d.csv", "time (s),animal_id,x,y", sorted(rows)))
    assert tomllib.loads(draft.text)["lifecycle"]["lifetime"] == "83000 s"
    assert vedette.load(tomllib.loads(draft.text)).run().score().tracks == 2


@pytest.mark.costly
def test_what_is_smoother_than_receivers_are_is_said(tmp_path):
    rng = np.random.default_rng(3)
    for error, told in ((0.3, True), (8.0, False)):
        spots = [(k, *((k * np.array([3.0, 4.0]) + rng.normal(0, error, 2)) / 111_195)) for k in range(120)]
        text = drafted(
            table(tmp_path / "d.csv", "time,lat,lon,sog", [(t, f"{y:.8f}", f"{x:.8f}", 5) for t, y, x in spots])
        ).text
        assert ("smoothed by the receivers' own filters" in text) == told


@pytest.mark.costly
@pytest.mark.parametrize("seed", [1, 2])
def test_a_storm_that_turns_from_report_to_report_is_motion_no_error(seed, tmp_path):
    """Errors of 490 and 252 km were found, as large as the spread of all, for the search began at a storm that goes on."""
    rng, spot, course, rows = np.random.default_rng(seed), np.array([36.0, -148.0]), 0.0, []
    for k in range(50):
        rows.append((f"2026-05-{1 + k // 8:02d} {3 * (k % 8):02d}:00", *(4 * spot).round() / 4))
        course += rng.normal(0.25, 0.5)
        spot = spot + rng.uniform(0.3, 2.0) * np.array([np.cos(course), np.sin(course)])
    assert not drafted(table(tmp_path / "d.csv", "time,lat,lon", rows)).failure
