"""An archive that grows is what `zipfile` reads, however large it is, and its directory costs its bytes alone."""

import tracemalloc
import zipfile
from io import BytesIO

import pytest

from vedette_files.growing_zip import append, end_record


def members(*names):
    def write(archive):
        for name in names:
            archive.writestr(name, f"content of {name}".encode(), zipfile.ZIP_DEFLATED)

    return write


def check(target, names):
    with zipfile.ZipFile(target) as archive:
        assert archive.namelist() == names
        assert archive.testzip() is None
        assert archive.read(names[-1]) == f"content of {names[-1]}".encode()


@pytest.fixture(params=["path", "memory"])
def target(tmp_path, request):
    place = tmp_path / "a.zip" if request.param == "path" else BytesIO()
    with zipfile.ZipFile(place, "w") as archive:
        members("first", "längst", "c" * 300)(archive)
    return place


def test_each_append_leaves_a_whole_archive(target):
    names = ["first", "längst", "c" * 300]
    for k in range(4):
        append(target, members(f"a{k}", f"b{k}"))
        names += [f"a{k}", f"b{k}"]
        check(target, names)
    append(target, members())
    check(target, names)


@pytest.mark.costly
def test_beyond_4_gib_and_beyond_65535_members(tmp_path):
    target, names = tmp_path / "a.zip", ["first", "second"]
    with zipfile.ZipFile(target, "w") as archive:
        members(*names)(archive)
    with target.open("r+b") as file, zipfile.ZipFile(file) as archive:  # a hole of 5 GiB before the directory
        begin, entries = archive.start_dir, len(archive.namelist())
        file.seek(begin)
        directory = file.read()[: -len(end_record(0, 0, 0))]
        file.seek(5 * 2**30)
        file.write(directory + end_record(entries, len(directory), 5 * 2**30))
    check(target, names)
    append(target, members("far", "away"))
    check(target, [*names, "far", "away"])
    many = [f"{k:x}" for k in range(66_000)]
    append(target, members(*many))
    tracemalloc.start()
    append(target, members("last"))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12e6  # of 4 MB of directory; its entries as objects are 40 MB
    with zipfile.ZipFile(target) as archive:
        assert archive.namelist() == [*names, "far", "away", *many, "last"]
        assert archive.read("last") == b"content of last"


def test_an_archive_that_is_cut_off_is_not_appended_to(target):
    if isinstance(target, BytesIO):
        target.seek(0, 2)
        target.truncate(target.tell() - 3)
    else:
        target.write_bytes(target.read_bytes()[:-3])
    with pytest.raises(zipfile.BadZipFile, match="the archive's end is missing"):
        append(target, members("more"))


class Disk(BytesIO):
    """A file on a disk with room for 2,000 bytes."""

    def write(self, content):
        room = 2_000 - self.tell()
        super().write(content[:room])
        if len(content) > room:
            raise OSError(28, "No space left on device")
        return len(content)


def test_a_full_disk_leaves_what_was_there():
    disk, names = Disk(), ["first"]
    with zipfile.ZipFile(disk, "w") as archive:
        members(*names)(archive)
    for k in range(6):
        append(disk, members(f"a{k}", f"b{k}"))
        names += [f"a{k}", f"b{k}"]
    with pytest.raises(OSError, match="No space left"):
        append(disk, members(*(f"c{k}" for k in range(30))))
    check(disk, names)
