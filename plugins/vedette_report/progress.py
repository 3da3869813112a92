"""The bar that shows on a terminal how far a command is."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from vedette.progress import Progress, silent
from vedette.types import come_once

T = TypeVar("T")


@contextmanager
def on_terminal() -> Iterator[Progress]:
    """Yield a bar on standard error where that is a terminal; without rich, a line for each loop; elsewhere nothing."""
    if not sys.stderr.isatty():
        yield silent
        return
    try:
        from rich import progress as shown
        from rich.console import Console
    except ImportError:
        yield _in_a_line
        return
    columns = (shown.MofNCompleteColumn(), shown.TextColumn("left"), shown.TimeRemainingColumn())
    with shown.Progress(
        *shown.Progress.get_default_columns()[:-1], *columns, console=Console(stderr=True), transient=True
    ) as bar:

        def track(items: Sequence[T], about: str, /) -> Iterable[T]:
            endless = come_once(items)  # what a camera gives: nobody knows how much
            return bar.track(iter(items) if endless else items, description=about)

        yield track


def _in_a_line(items: Sequence[T], about: str, /) -> Iterable[T]:
    print(f"{about}: {len(items):,} to go", file=sys.stderr)
    return items
