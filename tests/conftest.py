"""What several test files share lies in `support`; its assertions tell what they compared, like a test's own."""

import gc
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis.strategies import none

from vedette.testing.hypothesis_constants import constants_of_no_module

pytest.register_assert_rewrite("support")

MARKERS = (
    "kind(cls): a law of this component, tried where the component has changed and in one run of 40 where it has not",
    "costly(of): takes half a second; tried where what it tests, its file if not `of`, has changed, and in one run of 40",
    "by_turns: its cases make one statement; one is tried in every run, the others as costly tests are",
    "nightly(why): run in the nightly profile alone",
)
CHOSEN = pytest.StashKey[str]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that tries the laws of all kinds."""
    parser.addoption("--all", action="store_true", help="try all laws and all costly tests, changed or not")


def pytest_configure(config: pytest.Config) -> None:
    """Let Hypothesis draw the same examples in every run but the nightly ones, and wait for a busy machine.

    Ctrl-C is heard, as tests send it, where a script that started this in the background has it ignored.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    settings.register_profile("fast", deadline=None, derandomize=True)
    settings.register_profile("nightly", deadline=None)
    settings.load_profile(config.option.vedette_profile)
    session = ExitStack()
    session.enter_context(constants_of_no_module())
    config.add_cleanup(session.close)


@given(none())
def _drawn(_: None) -> None:
    """Have Hypothesis make its own random numbers before `gc.freeze`, after which 6.135 does not see who holds them."""


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Look for no garbage in what is collected, which stays to the end: that takes a quarter of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        _drawn()
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Iterator[list[pytest.Collector]]:
    """Look for no doctests in the tests: there are none, and that takes a tenth of the time."""
    return [file for file in (yield) if type(file) is pytest.Module]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out laws and costly tests that are not chosen, unless asked for by name, and by day the tests of the night."""
    if config.option.vedette_profile == "nightly":
        return
    for item in items:
        if (marker := item.get_closest_marker("nightly")) is not None:
            item.add_marker(pytest.mark.skip(reason=f"nightly: {marker.args[0]}"))
    by_name = config.option.all or config.option.keyword or any("::" in name for name in config.args)
    by_day = [item for item in items if item.get_closest_marker("nightly") is None]
    marks = {item: item.get_closest_marker("costly") or item.get_closest_marker("by_turns") for item in by_day}
    costly_items = {item.nodeid: item for item, mark in marks.items() if mark is not None}
    if costly_items and not by_name:
        from support.selection import by_turns, costly, since

        cases = [name for name, item in costly_items.items() if marks[item].name == "by_turns"]
        of = {name: next(iter(marks[item].args), item.path) for name, item in costly_items.items()}
        tried = costly(of, since()) | by_turns(cases, since())
        left = {item for name, item in costly_items.items() if name not in tried}
        config.hook.pytest_deselected(items=list(left))
        items[:] = [item for item in items if item not in left]
    kinds = {item: marker.args[0] for item in items if (marker := item.get_closest_marker("kind")) is not None}
    if not kinds or by_name:
        return
    from support.selection import chosen, since

    classes, config.stash[CHOSEN] = chosen(kinds.values(), since())
    left = {item for item, cls in kinds.items() if cls not in classes}
    config.hook.pytest_deselected(items=list(left))
    items[:] = [item for item in items if item not in left]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send what was chosen from a worker to the process that reports."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["chosen"] = session.config.stash.get(CHOSEN, "")


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Receive it."""
    node.config.stash[CHOSEN] = getattr(node, "workeroutput", {}).get("chosen") or node.config.stash.get(CHOSEN, "")


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print which kinds' laws were tried, and why these."""
    if line := config.stash.get(CHOSEN, ""):
        terminalreporter.write_line(line)
