"""Which component is at fault when a step fails: the step is made again, and what each method returns is looked at.

This costs nothing until something fails. What a method may silently do wrong is for the laws to find: `vedette check`.
"""

from __future__ import annotations

import dis
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from traceback import walk_tb
from types import CodeType, FrameType
from typing import Any, TypeVar, final

from vedette.errors import PluginError, VedetteError
from vedette.filters.gaussian import GaussianFilter
from vedette.roles import Component
from vedette.supporting import Command
from vedette.tracking.components import parts as parts_of
from vedette.tracking.postconditions import METHODS, broken
from vedette.types import Scan

T = TypeVar("T")

_LONGEST = 300
"""Characters of another's message, at most."""

_DEFAULTS = ("vedette.roles", "vedette.supporting", "vedette.wrapping")
"""Modules whose methods answer by a component's others: one of those that fails is named, not the default that asked it."""


@final
class _Watch:
    """Tells of the first method of a component that broke its promise; a function for `sys.setprofile`."""

    def __init__(self, parts: object) -> None:
        self.complaint: str | None = None
        self._parts = parts
        self._calls: dict[FrameType, tuple[Any, ...]] = {}

    def __call__(self, frame: FrameType, event: str, gave: Any) -> None:
        code = frame.f_code
        if self.complaint is not None or code.co_name not in METHODS:
            return
        if event == "call":
            if (given := _given(frame)) and _is_method(given[0], code):
                self._calls[frame] = given
        # A frame that an exception ends has a "return" too, of None, but not at an instruction that returns.
        elif frame in self._calls and dis.opname[code.co_code[frame.f_lasti]].startswith("RETURN"):
            component, given = self._calls[frame][0], self._calls.pop(frame)[1:]
            with suppress(Exception):  # what it was given is odd already: no fault of its own
                if wrong := broken(component, code.co_name, given, gave):
                    self.complaint = _told(component, code.co_name, wrong, self._parts)


def _is_method(owner: object, code: CodeType) -> bool:
    """Return whether a code is that of a method or property of a component."""
    its = (vars(cls).get(code.co_name) for cls in type(owner).__mro__)
    return isinstance(owner, Component) and any(getattr(getattr(one, "fget", one), "__code__", None) is code for one in its)


def _given(frame: FrameType) -> tuple[Any, ...]:
    """Return what a function was called with, in order."""
    code = frame.f_code
    given = tuple(frame.f_locals.get(name) for name in code.co_varnames[: code.co_argcount])
    if code.co_flags & inspect.CO_VARARGS:
        given += tuple(frame.f_locals.get(code.co_varnames[code.co_argcount + code.co_kwonlyargcount], ()))
    return given


def explain(error: Exception, parts: object, again: Callable[[], object], before: Callable[[], object] = object) -> None:
    """Raise PluginError, which names class and method, if a component of `parts` is at fault for an error.

    `again` does what failed once more, and `before` something of which it takes the results. Without a component at fault
    nothing is raised, but of nan.
    """
    if isinstance(error, VedetteError | MemoryError) or isinstance(sys.getprofile(), _Watch):
        return
    complaint, second = _made_again(parts, before, again)
    told = (raised_by(raised, parts) for raised in (*second, error) if not isinstance(raised, VedetteError))
    unknown = str(error) if isinstance(error, FloatingPointError) else None
    if text := complaint or next(filter(None, told), unknown):
        raise PluginError(text) from error


def broken_promise(parts: object, again: Callable[[], object]) -> str | None:
    """Return which component of `parts` broke its promise while something was done once more, None if all kept theirs."""
    return _made_again(parts, again)[0]


def _made_again(parts: object, *calls: Callable[[], object]) -> tuple[str | None, list[Exception]]:
    """Return which component broke its promise in some calls, and what the last raised: pictures, say, come once."""
    for _, component in parts_of(parts):
        if isinstance(component, GaussianFilter):  # it keeps what components answered before, and would not ask again
            component._memo.clear()
    watch, raised = _Watch(parts), list[Exception]()
    with watched_by(watch):
        for call in calls:
            raised.clear()
            try:
                call()
            except Exception as error:
                raised.append(error)
    return watch.complaint, raised


@contextmanager
def watched_by(watch: Callable[[FrameType, str, Any], None]) -> Iterator[None]:
    """Have a function told of calls, as by `sys.setprofile`, and then who was told before: `cProfile` by its own method."""
    earlier: Any = sys.getprofile()
    sys.setprofile(watch)
    try:
        yield
    finally:
        sys.setprofile(earlier if callable(earlier) else None)
        getattr(earlier, "enable", object)()


def check_again(parts: object, again: Callable[[], object]) -> None:
    """Raise PluginError if a component of `parts` breaks its promise when something is done once more."""
    if text := broken_promise(parts, again):
        raise PluginError(text)


def check_made(component: Component, method: str, gave: object, parts: object) -> None:
    """Raise PluginError if what a method gave is not what it must return."""
    if complaint := broken(component, method, (), gave):
        raise PluginError(_told(component, method, complaint, parts))


def raised_by(error: BaseException, parts: object, command: Command | None = None) -> str | None:
    """Return which component's method raised an error, with its place in `parts` and in its file; None if none did.

    Of commands, `command` alone is blamed.
    """
    component: Component | None = None
    method, line_of, passes_on = "", "", False
    for frame, line in walk_tb(error.__traceback__):
        code = frame.f_code
        if not code.co_argcount or code.co_filename.startswith("<attrs"):
            continue
        owner = frame.f_locals.get(code.co_varnames[0])
        if (owner is command or not isinstance(owner, Command)) and _is_method(owner, code):
            if owner is not component or passes_on:
                component, method = owner, code.co_name
                passes_on = frame.f_globals.get("__name__") in _DEFAULTS
            line_of = f"{Path(code.co_filename).name}:{line}"
    if component is None:
        return None
    reason = " ".join(str(error).split())[:_LONGEST] or "no reason given"
    return _told(component, method, f"raised {type(error).__name__}: {reason} ({line_of})", parts)


def _told(component: Component, method: str, complaint: str, parts: object) -> str:
    """Return a complaint with class, method, and place of the component, or of its like: a sensor at another pose, say."""
    places = {place: part for place, part in parts_of(parts) if type(part) is type(component)}
    place = next((place for place, part in places.items() if part is component), next(iter(places), ""))
    cls = type(component)
    who = f"{component.kind} ({cls.__module__}.{cls.__qualname__}).{method}"
    laws = "" if isinstance(component, Command) else f"; `vedette check {component.kind}` tries all that it must keep"
    return f"{place and f'{place}: '}{who} {complaint}{laws}"


def explain_run(error: Exception, parts: object, again: Callable[[], object]) -> None:
    """Raise PluginError if a component of `parts` is at fault for the end of a run, the first one in it that was.

    What a step took for the fault may have been given something wrong by another in a step before.
    """
    if isinstance(error, PluginError):
        check_again(parts, again)
    explain(error, parts, again)


def read(scans: Iterable[Scan], parts: object) -> Iterator[Scan]:
    """Yield the scans; PluginError if a component that makes them raises another's error."""
    try:
        yield from scans
    except Exception as error:
        if not isinstance(error, VedetteError | MemoryError | OSError) and (text := raised_by(error, parts)):
            raise PluginError(text) from error
        raise


def explained(parts: object, build: Callable[[], T]) -> T:
    """Return what `build` makes of some parts; PluginError if one of them is at fault that it cannot."""
    try:
        return build()
    except Exception as error:
        explain(error, parts, build)
        raise
