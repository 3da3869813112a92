"""`vedette explain`: what a config composes, in plain words, and what in it is out of proportion."""

from __future__ import annotations

import json
from argparse import Namespace
from textwrap import wrap

import numpy as np

from vedette.commands import DONE, options
from vedette.config import load
from vedette.tracking import explained
from vedette.units import in_unit
from vedette_tools.explaining import findings, situation
from vedette_tools.explaining.description import WIDTH, composed, figures, lines
from vedette_tools.explaining.situation import fused


def run(arguments: Namespace) -> int:
    """Print the parts, what follows from them, and the findings, each with its place."""
    experiment = load(arguments.config, overrides=arguments.overrides)
    interval = options.read("--interval", arguments.interval, _seconds)
    with np.errstate(invalid="ignore"):  # a component that gives nan is told by name
        it = explained(experiment, lambda: situation(experiment, interval))
        found = explained(experiment, lambda: list(findings(it)))
    for line in lines(it):
        print(line)
    print()
    count = {0: "nothing is", 1: "1 thing is"}.get(len(found), f"{len(found)} things are")
    unseen = experiment.source is not None and it.opened.recording is None
    print(f"{count} out of proportion{' in the config alone' if unseen else ''}")
    for each in found:
        for line in wrap(str(each), WIDTH, initial_indent="  ", subsequent_indent="    "):
            print(line)
    if arguments.json:
        told = {
            "title": experiment.title,
            "parts": composed(it),
            "sensors": [figures(seen, it) for seen in it.sensors],
            "together": fused(it),
            "findings": [each.data() for each in found],
            "unopened": it.opened.why,
        }
        print(json.dumps(told))
    return DONE


def _seconds(given: str) -> float:
    """Return the interval given in s."""
    value = in_unit(given, "s", 1e9)
    if not value > 0:
        raise ValueError(f"must be > 0, got {value:g} s")
    return value
