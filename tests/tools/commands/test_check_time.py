"""`vedette check KIND` finds nothing in what is shipped, in under 10 s of CPU time; nightly, as all kinds take minutes."""

import time

import pytest

from vedette import Registry
from vedette.config.parameters import APART
from vedette.testing.law import Profile
from vedette_tools.commands.check import check

LIMIT = 10.0
WITHOUT_LAWS = ("input", "output", "store")
ENTRIES = [entry for entry in Registry.installed() if entry.role not in (*APART, *WITHOUT_LAWS)]


@pytest.mark.nightly("all kinds take minutes")
@pytest.mark.parametrize("entry", ENTRIES, ids=[f"{entry.role}-{entry.kind}" for entry in ENTRIES])
def test_a_check_is_short_and_finds_nothing(entry, capsys):
    began = time.process_time()
    found = check(entry.cls, Profile.named("fast", 0))
    taken = time.process_time() - began
    assert capsys.readouterr().out.startswith(f"{entry.role} {entry.kind} ")
    assert taken < LIMIT, f"{entry.kind}: {taken:.1f} s of CPU time"
    wrong = [law["law"] for law in found["laws"] if law["verdict"] == "failed"]
    assert not wrong, f"{entry.kind}: {wrong}"
