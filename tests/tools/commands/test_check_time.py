"""`vedette check KIND` finds nothing in what is shipped, and asks no more of it than takes some seconds; nightly."""

import cProfile

import pytest

from vedette import Registry
from vedette.config.parameters import APART
from vedette.testing.law import Profile
from vedette_tools.commands.check import check

MOST = 20_000_000
"""Calls of functions: twice those of the kinds with the most when this was written, 'range_bearing_rate' and
'radar_points_scene'. A million take about a second; ten times the examples make seven times as many.
"""
WITHOUT_LAWS = ("input", "output", "store")
ENTRIES = [entry for entry in Registry.installed() if entry.role not in (*APART, *WITHOUT_LAWS)]


@pytest.mark.nightly("all kinds take minutes")
@pytest.mark.parametrize("entry", ENTRIES, ids=[f"{entry.role}-{entry.kind}" for entry in ENTRIES])
def test_a_check_is_short_and_finds_nothing(entry, capsys):
    with cProfile.Profile() as profiler:
        found = check(entry.cls, Profile.named("fast", 0))
    calls = sum(each.callcount for each in profiler.getstats())
    assert capsys.readouterr().out.startswith(f"{entry.role} {entry.kind} ")
    assert calls < MOST, f"{entry.kind}: {calls:,} calls"
    wrong = [law["law"] for law in found["laws"] if law["verdict"] == "failed"]
    assert not wrong, f"{entry.kind}: {wrong}"
