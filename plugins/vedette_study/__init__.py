"""Studies of many runs: a grid of trackers, run in lock-step or run by run, in threads, processes or on a cluster."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable
from pathlib import Path

from vedette import Component, plugin
from vedette_study.commands import Reproduce, Study

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Reproduce, Study]


@plugin
def vedette_page(folder: Path, arguments: Namespace) -> Path | None:
    """Write the page of a study's folder."""
    from vedette_study.commands.page import page_asked_for

    return page_asked_for(folder, arguments)
