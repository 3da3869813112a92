"""What an experiment composes, in plain words, and what in it is out of proportion, from its components' own figures."""

from __future__ import annotations

from collections.abc import Iterator

from vedette_tools.explaining import motion_rules, return_rules, track_rules
from vedette_tools.explaining.finding import Finding
from vedette_tools.explaining.situation import Situation, situation

__all__ = ["Finding", "Situation", "findings", "situation"]


def findings(it: Situation) -> Iterator[Finding]:
    """Yield what is out of proportion, each place and fact once."""
    told = set()
    for rule in (*return_rules.RULES, *motion_rules.RULES, *track_rules.RULES):
        for finding in rule(it):
            if (rule, finding.place) not in told:
                told.add((rule, finding.place))
                yield finding
