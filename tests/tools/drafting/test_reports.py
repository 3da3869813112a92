"""Returns without names: whose they are, where errors are larger than steps, and among false ones."""

import tomllib

import numpy as np
import pytest

from benchmarks import drafts
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.reading import REPORTED, Reading, opened
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.reports import LEAST, _followed, in_turn, longest_waits


def file_of(path, rows):
    path.write_text("time,x,y\n" + "".join(f"{t:.3f},{x:.2f},{y:.2f}\n" for t, x, y in sorted(rows)))
    return path


@pytest.mark.parametrize("error", [0.1, 1.0, 3.0])
@pytest.mark.costly
def test_targets_that_report_in_turn_have_a_chain_each(error):
    """Errors of that many steps; where chains may take turns for nothing, three targets have fourteen."""
    rng = np.random.default_rng(11)
    start, pace, own = rng.uniform(-8000, 8000, (3, 2)), rng.normal(0, 30, (3, 2)), np.tile(np.arange(3), 100)
    times = np.sort(rng.uniform(0, 500, 300))
    step = 30.0 * 5.0
    spots = start[own] + pace[own] * times[:, None] + error * step * rng.normal(size=(300, 2))
    chains = in_turn(times, list(spots[:, None]))
    large = [chain for chain in chains if len(chain.times) >= 50]
    assert len(large) == 3
    assert len(chains) <= 4
    for chain in large:  # where two pass each other within their errors, some go over
        assert 85 <= len(chain.times) <= 110
        assert np.max(np.bincount(own[chain.scans])) > 0.9 * len(chain.times)


@pytest.mark.parametrize("moved", [0.0, 3.0, 10.0, 30.0])
@pytest.mark.by_turns
def test_a_target_at_rest_or_nearly_so_has_one_chain(moved):
    """Moved by so many errors in all: at rest these are a fifth of the area's side, and a tenth made three chains of it."""
    rng = np.random.default_rng(12)
    spots = 27.0 * (moved * np.linspace(0, 1, 160)[:, None] * [1.0, 0.0] + rng.normal(size=(160, 2)))
    longest = max(in_turn(0.4 * np.arange(160), list(spots[:, None])), key=lambda chain: len(chain.times))
    assert len(longest.times) > 150


def scene(seed, false):
    """One target that hovers, flies 5 m/s, and hovers, 40 looks 5 s apart with errors of 1 m, and `false` returns a look."""
    rng = np.random.default_rng(seed)
    for k in range(40):
        yield 5.0 * k, *(np.array([25.0 * np.clip(k - 10, 0, 15), 0.0]) + rng.normal(0, 1.0, 2))
        yield from ((5.0 * k, *spot) for spot in rng.uniform(-800, 800, (rng.poisson(false), 2)))


@pytest.mark.costly
def test_chains_of_false_returns_are_not_taken_for_targets(tmp_path):
    """Twenty chains that chance made, of seven returns each, were drafted as errors of 10 m for 1."""
    path = file_of(tmp_path / "d.csv", scene(2, 60))
    table = read_table(path)
    found = Reading.of(table, opened(table))
    assert len(found.seen["sensor"].chains) <= 3
    assert found.noise["sensor"].sensor[0] == pytest.approx(1.0, rel=0.35)


@pytest.mark.costly
def test_few_false_returns_beside_one_target_are_no_reports_in_turn(tmp_path):
    """Seven chains of six of them over 120 to 160 scans each held a draft of one circling target for reports in turn."""
    table = read_table(file_of(tmp_path / "d.csv", drafts.drawn(80, 261126).rows.tolist()))
    (seen,) = Reading.of(table, opened(table)).seen.values()
    assert not seen.in_turn
    assert len(seen.chains) == 1


@pytest.mark.costly
def test_a_target_that_hovers_and_flies_among_false_returns_is_drafted(tmp_path):
    draft = drafted(file_of(tmp_path / "d.csv", scene(3, 60)))
    assert draft.failure == ""
    assert "sigma = " in draft.text


@pytest.mark.costly
def test_positions_that_stand_in_several_rows_are_told(tmp_path):
    rows = [(0.1 * k, 10.0 * (k // 10), 3.0 * (k // 10)) for k in range(250)]
    assert "each position stands in some 10 rows" in drafted(file_of(tmp_path / "d.csv", rows)).failure


def test_the_longest_wait_of_each_name_that_comes_often():
    """Scans of one or two returns: of the nameless (-1) and of a name that comes seldom nothing is told."""
    seven = [0, 1, 2, 3, 9, 10, 14]
    named = [[4, 7] if i in seven else [4] if i < LEAST + 4 else [-1] for i in range(20)]
    named[19] = [5]
    assert longest_waits([np.array(codes) for codes in named], 10 * np.arange(20)).tolist() == [40.0, 60.0]


def test_a_name_that_comes_back_after_years_is_given_again_and_did_not_wait():
    """As names of storms are, after six or twelve years: tracks were kept for as long."""
    times = np.concatenate([6 * np.arange(20), 105_000 + 6 * np.arange(20)])
    assert longest_waits([np.array([0])] * 40, times).tolist() == [6.0]


@pytest.mark.costly
def test_what_reports_are_not_wrong_by_is_motion(tmp_path):
    """Aircraft whose places are up to a second old: as a sensor's returns they are wrong by more than 5 m."""
    rng = np.random.default_rng(12)
    start, course = rng.uniform(-5e4, 5e4, (8, 2)), rng.uniform(0, 2 * np.pi, 8)
    rows = []
    for i in range(60):
        age = rng.uniform(0, 1, 8)
        spots = start + 200 * (10 * i - age)[:, None] * np.stack([np.cos(course), np.sin(course)], axis=-1)
        places = enumerate(spots.tolist())
        rows += [f"{10 * i},a{name},{47 + x / 111_195:.6f},{8 + y / 75_000:.6f}" for name, (x, y) in places]

    def found(title):
        (tmp_path / "d.csv").write_text("\n".join([f"time,{title},lat,lon", *rows]) + "\n")
        table = read_table(tmp_path / "d.csv")
        return Reading.of(table, opened(table)).noise["sensor"]

    reported, measured = found("icao24"), found("id")
    assert reported.sensor[0] <= REPORTED < measured.sensor[0]
    assert reported.accel > 1.2 * measured.accel


def test_what_is_tried_together_is_followed_as_if_each_were_alone():
    rng = np.random.default_rng(3)
    scan, spots = np.repeat(np.arange(40), 3), rng.uniform(0, 300, (120, 2))
    tried = np.array([[1.0, 1.0, 0.1], [30.0, 10.0, 1.0], [60.0, 100.0, 20.0]])
    owners, likely = _followed(2.0 * scan - 60.0, spots, scan, tried, 9e4)
    assert len({owner.max() for owner in owners}) == 3  # they begin unlike numbers of chains
    for i, one in enumerate(tried):
        (owner,), alone = _followed(2.0 * scan - 60.0, spots, scan, one[None], 9e4)
        np.testing.assert_array_equal(owner, owners[i])
        assert alone == likely[i]


@pytest.mark.costly
def test_what_a_receiver_wrote_of_itself_is_no_surer_than_a_decimetre(tmp_path):
    """A smoothed path of steady pace and climb, whose second differences are those of rounding."""
    points = "".join(
        f'<trkpt lat="{45.2 + 9e-5 * k:.7f}" lon="13.7"><ele>{10 + 0.3 * k:.1f}</ele>'
        f"<time>2024-05-01T10:{k // 60:02}:{k % 60:02}Z</time></trkpt>"
        for k in range(120)
    )
    (tmp_path / "walk.gpx").write_text(f"<gpx><trk><trkseg>{points}</trkseg></trk></gpx>")
    (receiver,) = tomllib.loads(drafted(tmp_path / "walk.gpx").text)["sensors"].values()
    assert np.diag(receiver["R"]).min() >= 0.01
