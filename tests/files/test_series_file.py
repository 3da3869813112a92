"""The file of a run's series: it grows, it is whole after each block, and a bad one is refused with its name."""

from io import BytesIO

import numpy as np
import pytest

from vedette.errors import InputError
from vedette_files import read_series
from vedette_files.series import SeriesFile


def columns(start, count):
    return {"scans": {"time": np.arange(start, start + count) * 0.5, "place": np.full((count, 2), float(start))}}


def test_blocks_read_back_as_one_table_in_order(tmp_path):
    file = SeriesFile(tmp_path / "s.npz", {"title": "two"})
    for i in range(0, 36, 3):
        file.add(columns(i, 3))
        file.flush()
    found = read_series(tmp_path / "s.npz")
    assert found.about["title"] == "two"
    np.testing.assert_array_equal(found["scans"]["time"], np.arange(36) * 0.5)
    np.testing.assert_array_equal(found["scans"]["place"][:, 0], np.repeat(np.arange(0, 36, 3), 3))


def test_it_is_whole_after_each_block_and_without_a_last_word(tmp_path):
    """A run that is killed leaves what it had written."""
    file = SeriesFile(tmp_path / "s.npz", {})
    assert read_series(tmp_path / "s.npz").tables == {}
    file.add(columns(0, 300_000))
    file.add(columns(1, 2))
    assert len(read_series(tmp_path / "s.npz")["scans"]["time"]) == 300_000


def test_equal_series_give_equal_bytes():
    first, second = BytesIO(), BytesIO()
    for target in (first, second):
        file = SeriesFile(target, {"title": "same"})
        file.add(columns(0, 3))
        file.flush()
    assert first.getvalue() == second.getvalue()


def test_a_bad_file_is_refused_with_its_name(tmp_path):
    with pytest.raises(InputError, match=r"none\.npz: there is no such file"):
        read_series(tmp_path / "none.npz")
    file = SeriesFile(tmp_path / "s.npz", {})
    file.add(columns(0, 3))
    file.flush()
    whole = (tmp_path / "s.npz").read_bytes()
    for i, content in enumerate((b"", b"text", whole[: len(whole) // 2])):
        (tmp_path / f"bad{i}.npz").write_bytes(content)
        with pytest.raises(InputError, match=rf"bad{i}\.npz: must be the series of a run"):
            read_series(tmp_path / f"bad{i}.npz")
    SeriesFile(tmp_path / "later.npz", {"version": 2})
    with pytest.raises(InputError, match=r"this Vedette reads 'vedette series'.*1"):
        read_series(tmp_path / "later.npz")
    np.savez(tmp_path / "other.npz", pixels=np.zeros(3))
    with pytest.raises(InputError, match=r"it has no about\.json"):
        read_series(tmp_path / "other.npz")
    file.add({"scans": {"time": np.zeros(2)}})
    file.flush()
    with pytest.raises(InputError, match="columns of 'scans' must have"):
        read_series(tmp_path / "s.npz")
