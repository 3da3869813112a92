"""`vedette watch`: a run while it goes, on a page of this machine or in the terminal."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from vedette.commands import DONE, INTERRUPTED, options
from vedette.config import load, to_config, warnings_of
from vedette.errors import ConfigError
from vedette.experiment import Experiment, Steps, Watch
from vedette.types import come_once
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder
from vedette_report.running.streaming import stream
from vedette_report.watching.page import LivePage
from vedette_report.watching.real_time import Pace, read_speed
from vedette_report.watching.terminal import TerminalView


def run(arguments: Namespace) -> int:
    """Run and show; return 130 if Ctrl-C ended it early, with what was done written all the same."""
    experiment = load(arguments.config, overrides=options.overrides(arguments))
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    pace, port = Pace(options.read("--speed", arguments.speed, read_speed) or 1.0), _port(arguments)
    steps = experiment.steps(progress=pace)
    if arguments.speed is not None and come_once(steps.recording.scans):
        raise ConfigError.at("--speed", "is for recordings: these scans come at their own pace")
    view: LivePage | TerminalView
    if arguments.terminal:
        view = TerminalView(experiment, steps, pace)
    else:
        underlay = None if arguments.underlay is None else Path(arguments.underlay)
        came = lambda: pace.came  # noqa: E731
        view = LivePage(experiment, steps.recording, steps.state, came, port=port, underlay=underlay)
        print(f"{view.server.address}", flush=True)
    return _follow(experiment, steps, folder, view, arguments)


def _follow(
    experiment: Experiment, steps: Steps, folder: Path | None, view: LivePage | TerminalView, arguments: Namespace
) -> int:
    """Run to the end, and let the view show it; return the exit code."""
    interrupted, figures, lines = True, dict[str, Any](), list[str]()
    try:
        if folder is None:
            interrupted, confirmed = _through(experiment, steps, view.take)
            figures = {"scans_taken": steps.intake.scans, "begun": steps.state.born, "confirmed": confirmed}
            lines = [
                f"LOOKS WRONG: {said}" for said in warnings_of(steps.intake, steps.recording, experiment.tracker.sensors)
            ]
            lines += [f"{steps.intake.scans} scans, {confirmed} confirmed tracks of {steps.state.born} begun"]
        else:
            reads = Inputs.of(arguments.config, to_config(experiment))
            done = stream(experiment, folder, steps=steps, shown=view.take, reads=reads)
            interrupted, figures = done.result.interrupted, done.figures
            lines = [done.brief, f"{folder}: {', '.join(done.files)}"]
            for problem in done.problems:
                print(f"vedette: {problem}", file=sys.stderr)
        if isinstance(view, LivePage) and not interrupted and not view.server.greeted.is_set():
            print("vedette: the run has ended, and waits until somebody has seen the page; Ctrl-C ends it", file=sys.stderr)
            _wait_for_somebody(view)
    finally:
        view.end(interrupted=interrupted)
    print("\n".join(lines))
    if arguments.json:
        print(json.dumps({"interrupted": interrupted, **figures}))
    return INTERRUPTED if interrupted else DONE


def _through(experiment: Experiment, steps: Steps, take: Watch) -> tuple[bool, int]:
    """Make all steps and keep nothing; return whether Ctrl-C ended them, and how many tracks were ever confirmed."""
    tracker, confirmed, alive = experiment.tracker, 0, set[int]()
    try:
        for scan, state in steps:
            take(scan, steps.before, state, tracker.estimate(state), tracker.estimator.mode_prob(state.belief))
            known = alive & set(state.ids.tolist())
            alive = known | set(state.ids[state.confirmed].tolist())
            confirmed += len(alive) - len(known)
    except KeyboardInterrupt:
        return True, confirmed
    return False, confirmed


def _wait_for_somebody(view: LivePage) -> None:
    """Wait until a browser has opened the page, or for Ctrl-C: the run is done all the same."""
    try:
        while not view.server.greeted.wait(0.2):
            pass
    except KeyboardInterrupt:
        return


def _port(arguments: Namespace) -> int:
    """Return the port that is asked for, 0 for any; ConfigError if it is none."""
    for name in ("port", "underlay"):
        if arguments.terminal and getattr(arguments, name) is not None:
            raise ConfigError.at(f"--{name}", "is for the page, and --terminal shows none: give one of the two")
    return options.whole("--port", arguments.port, 0, least=1, most=65535)
