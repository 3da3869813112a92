"""Arrays and tables of results are read up to stated limits, and whatever is wrong with them is told in a line."""

import io
import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from vedette import ConfigError, InputError
from vedette.limits import FACTOR, most
from vedette_files.archives import open_arrays
from vedette_files.json_values import parse, read_table

GOOD = {"times": np.arange(5.0), "hit": np.array([[True, False]]), "names": np.array(["a", "bc"])}


def archive(path, members, compression=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", compression) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return path


def stored(array, **header):
    """An array's bytes, with its header changed."""
    content = io.BytesIO()
    np.lib.format.write_array(content, array, allow_pickle=True)
    if not header:
        return content.getvalue()
    told = {"descr": np.lib.format.dtype_to_descr(array.dtype), "fortran_order": False, "shape": array.shape} | header
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, told)
    return head.getvalue() + array.tobytes()


def read_all(path):
    with open_arrays(path) as arrays:
        return {name: arrays[name] for name in arrays.names}


def test_arrays_come_back_as_they_were(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", **GOOD, turned=np.asfortranarray(np.arange(6.0).reshape(2, 3)))
    found = read_all(tmp_path / "a.npz")
    for name, values in GOOD.items():
        np.testing.assert_array_equal(found[name], values)
    np.testing.assert_array_equal(found["turned"], np.arange(6.0).reshape(2, 3))
    assert found["times"].flags.writeable


def one_byte_off(path):
    data = bytearray(path.read_bytes())
    data[60] ^= 0xFF
    path.write_bytes(bytes(data))


WRONG = {
    "more than it has": {"a": stored(np.arange(3.0), shape=(10**12,))},
    "more than a number can say": {"a": stored(np.arange(3.0), shape=(2**62, 2**62))},
    "less than nothing": {"a": stored(np.arange(3.0), shape=(-1, -3))},
    "objects": {"a": stored(np.array([{}, None], dtype=object))},
    "no header": {"a": b"\x93NUMPY\x01\x00\x10\x00" + b"(" * 16},
    "another version": {"a": b"\x93NUMPY\x09\x00" + bytes(40)},
    "Python's code for a type": {"a": b"\x93NUMPY\x01\x00\x76\x00" + b"{'descr': __import__('os')}".ljust(117) + b"\n"},
    "nothing at all": {"a": b""},
}


@pytest.mark.parametrize("what", WRONG)
def test_an_array_that_is_not_what_it_says_is_refused(what, tmp_path):
    with pytest.raises(InputError, match=r"a\.npz: "):
        read_all(archive(tmp_path / "a.npz", WRONG[what]))


@pytest.mark.parametrize("cut", [0, 1, 30, 100, -1, -10])
def test_a_cut_or_altered_archive_is_refused(cut, tmp_path):
    path = archive(tmp_path / "a.npz", {"a": stored(np.arange(100.0))})
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(InputError, match=r"a\.npz"):
        read_all(path)
    one_byte_off(archive(path, {"a": stored(np.arange(100.0))}))
    with pytest.raises(InputError, match=r"a\.npz"):
        read_all(path)


def test_what_is_no_file_is_refused(tmp_path):
    for place in (tmp_path, tmp_path / "none.npz", tmp_path / "a" / "b.npz"):
        with pytest.raises(InputError):
            read_all(place)
        with pytest.raises(InputError):
            read_table(place)


@pytest.mark.costly
def test_a_small_file_that_unpacks_to_much_is_refused_before_it_does(tmp_path, monkeypatch):
    """1 MB of deflated zeros once took 1 GB; the factor raises the limit."""
    path = archive(tmp_path / "a.npz", {"a": stored(np.zeros(2**24 + 2**20))})
    assert path.stat().st_size < 10**6
    with pytest.raises(InputError, match="142,606,464"):
        read_all(path)
    monkeypatch.setenv(FACTOR, "2")
    assert read_all(path)["a"].shape == (2**24 + 2**20,)


HOSTILE = """
import resource, sys
from pathlib import Path
from vedette import VedetteError
import vedette.commands
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
from vedette.cli import main
code = main(sys.argv[1:])
print(code, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
"""


@pytest.mark.costly
def test_a_report_of_a_hostile_series_takes_little_memory(tmp_path):
    """3.2 MB of series once took 3 GB."""
    pytest.importorskip("matplotlib")
    about = json.dumps({"format": "vedette series", "version": 1})
    with zipfile.ZipFile(tmp_path / "series.npz", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("about.json", about)
        file.writestr("entries.time.0.npy", stored(np.zeros(2**24 + 2**23)))
    done = subprocess.run(
        [sys.executable, "-c", HOSTILE, "report", str(tmp_path)], capture_output=True, text=True, check=True, timeout=60
    )
    code, grown = map(int, done.stdout.splitlines()[-1].split())
    assert code == 2
    assert grown < 500
    assert len(done.stderr.splitlines()) == 1


TABLES = {
    "nothing": b"",
    "a list": b"[]",
    "cut": b'{"a": [1,',
    "deep": b"[" * 100_000,
    "deep objects": b'{"a":' * 2000 + b"1" + b"}" * 2000,
    "no UTF-8": b'{"a": "\xff"}',
    "a number of a million digits": b'{"a": ' + b"9" * 10**6 + b"}",
    "half a character": b'{"a": "\\ud800"}',
}


@pytest.mark.parametrize("what", TABLES)
def test_a_table_that_is_none_is_refused_with_its_name(what, tmp_path):
    (tmp_path / "a.json").write_bytes(TABLES[what])
    with pytest.raises(InputError, match=r"a\.json: "):
        read_table(tmp_path / "a.json")


def test_a_large_table_is_refused(tmp_path, monkeypatch):
    (tmp_path / "a.json").write_text(json.dumps({"a": "x" * 1000}))
    monkeypatch.setattr("vedette_files.json_values.LARGEST_TABLE", 1000)
    with pytest.raises(InputError, match="larger than 1,000 bytes"):
        read_table(tmp_path / "a.json")
    monkeypatch.setenv(FACTOR, "1.1")
    assert read_table(tmp_path / "a.json") == {"a": "x" * 1000}


@pytest.mark.parametrize("factor", ["0.5", "nan", "inf", "-3", "x", ""])
def test_a_factor_that_is_none_is_refused(factor, monkeypatch):
    monkeypatch.setenv(FACTOR, factor)
    with pytest.raises(ConfigError, match="--limits"):
        most(10)


def test_the_depth_that_configs_have_is_read():
    assert parse('{"a": [[1]]}') == {"a": [[1]]}
