"""Which component is at fault when a step fails: the step is made again, and what each method returns is looked at.

This costs nothing until something fails. What a method may silently do wrong is for the laws to find: `vedette check`.
"""

from __future__ import annotations

import dis
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from traceback import walk_tb
from types import CodeType, FrameType
from typing import Any, TypeVar, final

import attrs

from vedette.errors import PluginError, VedetteError
from vedette.filters.memo import Memo
from vedette.roles import Component
from vedette.supporting import Command
from vedette.tracking.parts import parts as parts_of
from vedette.tracking.postconditions import METHODS, broken
from vedette.types import Scan

T = TypeVar("T")

_LONGEST = 300
"""Characters of another's message, at most."""


@final
class _Watch:
    """Notes the first method of a component that broke its promise, as a function for `sys.setprofile`."""

    def __init__(self) -> None:
        self.found: tuple[Component, str, str] | None = None
        self._given: dict[FrameType, tuple[Any, ...]] = {}

    def __call__(self, frame: FrameType, event: str, gave: Any) -> None:
        code = frame.f_code
        if self.found is not None or code.co_name not in METHODS:
            return
        if event == "call":
            given = _given(frame)
            if given and _is_method(given[0], code):
                self._given[frame] = given
        elif event == "return" and frame in self._given and _returns(frame):
            owner, took = self._given[frame][0], self._given.pop(frame)[1:]
            try:
                if complaint := broken(owner, code.co_name, took, gave):
                    self.found = owner, code.co_name, complaint
            except Exception:  # what it was given is odd already: no fault of its own
                return


def _is_method(owner: object, code: CodeType) -> bool:
    """Return whether a code is that of a method or property of a component."""
    if not isinstance(owner, Component):
        return False
    own = [vars(cls).get(code.co_name) for cls in type(owner).__mro__]
    return any(getattr(getattr(each, "fget", each), "__code__", None) is code for each in own)


def _given(frame: FrameType) -> tuple[Any, ...]:
    """Return what a function was called with, in order."""
    code = frame.f_code
    given = tuple(frame.f_locals.get(name) for name in code.co_varnames[: code.co_argcount])
    if code.co_flags & inspect.CO_VARARGS:
        given += tuple(frame.f_locals.get(code.co_varnames[code.co_argcount + code.co_kwonlyargcount], ()))
    return given


def _returns(frame: FrameType) -> bool:
    """Return whether a frame that ends returns a value, and raises nothing."""
    return dis.opname[frame.f_code.co_code[frame.f_lasti]].startswith("RETURN")


def explain(error: Exception, parts: object, again: Callable[[], object], before: Callable[[], object] = object) -> None:
    """Raise PluginError, which names class and method, if a component of `parts` is at fault for an error.

    `again` does what failed once more, and `before` something of which it takes the results. Without a component at fault
    nothing is raised.
    """
    if isinstance(error, VedetteError | MemoryError) or isinstance(sys.getprofile(), _Watch):
        return
    second = error
    watch = _Watch()
    with suppress(Exception):
        _watched(watch, parts, before)
    try:
        _watched(watch, parts, again)
    except Exception as raised:
        second = raised
    if watch.found is not None:
        raise PluginError(_told(*watch.found, parts)) from error
    for each in (second, error):
        if not isinstance(each, VedetteError) and (text := raised_by(each, parts)):
            raise PluginError(text) from error


def broken_promise(parts: object, again: Callable[[], object]) -> str | None:
    """Return which component of `parts` broke its promise while something was done, None if all kept theirs."""
    watch = _Watch()
    _watched(watch, parts, again)
    return None if watch.found is None else _told(*watch.found, parts)


def check_again(parts: object, again: Callable[[], object]) -> None:
    """Raise PluginError if a component of `parts` breaks its promise when something is done once more."""
    watch = _Watch()
    with suppress(Exception):  # it cannot be done again, as pictures come once, say; or it fails again
        _watched(watch, parts, again)
    if watch.found is not None:
        raise PluginError(_told(*watch.found, parts))


def check_made(component: Component, method: str, gave: object, parts: object) -> None:
    """Raise PluginError if what a method gave is not what it must return."""
    if complaint := broken(component, method, (), gave):
        raise PluginError(_told(component, method, complaint, parts))


def _watched(watch: _Watch, parts: object, again: Callable[[], object]) -> None:
    """Do something once more under a watch, without what filters have kept of the components' answers."""
    for _, component in parts_of(parts):
        for value in _values(component):
            if isinstance(value, Memo):
                value.clear()
    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        again()
    finally:
        sys.setprofile(before)


def raised_by(error: BaseException, parts: object) -> str | None:
    """Return which component's method raised an error, with its place in `parts` and in its file; None if none did."""
    owner: Component | None = None
    method = at = ""
    for frame, line in walk_tb(error.__traceback__):
        code = frame.f_code
        if not code.co_argcount or code.co_filename.startswith("<attrs"):
            continue
        found = frame.f_locals.get(code.co_varnames[0])
        if isinstance(found, Component) and not isinstance(found, Command) and _is_method(found, code):
            if found is not owner:
                owner, method = found, code.co_name
            at = f"{Path(code.co_filename).name}:{line}"
    if owner is None:
        return None
    reason = " ".join(str(error).split())[:_LONGEST]
    return _told(owner, method, f"raised {type(error).__name__}: {reason or 'no reason given'} ({at})", parts)


def _told(component: Component, method: str, complaint: str, parts: object) -> str:
    place = next((place for place, each in parts_of(parts) if each is component), None)
    if place is None:  # a sensor that was placed elsewhere, say
        place = next((place for place, each in parts_of(parts) if type(each) is type(component)), None)
    cls = type(component)
    who = f"{component.kind} ({cls.__module__}.{cls.__qualname__}).{method}"
    hint = f"`vedette check {component.kind}` tries all that it must keep"
    return f"{f'{place}: ' if place else ''}{who} {complaint}; {hint}"


def _values(value: Any) -> list[Any]:
    return [getattr(value, field.name, None) for field in attrs.fields(type(value))] if attrs.has(type(value)) else []


def explain_run(error: Exception, parts: object, again: Callable[[], object]) -> None:
    """Raise PluginError if a component of `parts` is at fault for the end of a run, the first one in it that was.

    What a step took for the fault may have been given something wrong by another in a step before.
    """
    if isinstance(error, PluginError):
        check_again(parts, again)
    explain(error, parts, again)


def blamed(error: Exception, parts: object) -> None:
    """Raise PluginError if a method of a component raised an error; its place is that in `parts`."""
    if not isinstance(error, VedetteError | MemoryError | OSError) and (text := raised_by(error, parts)):
        raise PluginError(text) from error


def read(scans: Iterable[Scan], parts: object) -> Iterator[Scan]:
    """Yield the scans; PluginError if what makes them raises another's error."""
    try:
        yield from scans
    except Exception as error:
        blamed(error, parts)
        raise


def explained(parts: object, build: Callable[[], T]) -> T:
    """Return what `build` makes of some parts; PluginError if one of them is at fault that it cannot."""
    try:
        return build()
    except Exception as error:
        explain(error, parts, build)
        raise
