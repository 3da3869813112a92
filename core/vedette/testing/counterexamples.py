"""What a counterexample says: the call that was made, with shapes, the component and the data, each in a line."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from traceback import walk_tb
from types import FrameType
from typing import Any

import attrs
import numpy as np

from vedette.roles import Component

WIDTH = 240
"""Characters of a line, at most."""


def method_of(error: BaseException) -> str:
    """Return which method of a component an error comes from, as the start of a sentence: the outermost on its way."""
    for frame, _ in walk_tb(error.__traceback__):
        owner = frame.f_locals.get("self")
        if isinstance(owner, Component):
            return f"{owner.kind}.{frame.f_code.co_name} "
    return ""


def line_of(error: BaseException) -> str:
    """Return the file and line of the innermost method of a component on an error's way, in brackets."""
    found = ""
    for frame, line in walk_tb(error.__traceback__):
        if isinstance(frame.f_locals.get("self"), Component):
            found = f" ({frame.f_code.co_filename}:{line})"
    return found


def last_call(component: Component, check: Callable[[], None]) -> str:
    """Run a check that fails, and return the last call of a method of the component in it, with what it took and gave."""
    methods = {name for name in dir(type(component)) if not name.startswith("_")}
    made: dict[str, str] = {"text": ""}
    depth = [0]

    def watch(frame: FrameType, event: str, result: Any) -> None:
        code = frame.f_code
        if code.co_name not in methods or event not in ("call", "return") or not code.co_argcount:
            return
        if frame.f_locals.get(code.co_varnames[0]) is not component or code.co_argcount == 1:
            return
        depth[0] += 1 if event == "call" else -1
        if event == "call" and depth[0] == 1:
            given = inspect.getargvalues(frame)
            parts = [f"{name} {brief(given.locals[name])}" for name in given.args[1:]]
            made["text"] = f"{code.co_name}({', '.join(parts)})"
        elif event == "return" and depth[0] == 0:
            made["text"] += f" -> {brief(result)}" if result is not None else ""

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        check()
    except Exception:  # it fails again: that is what it is run for
        pass
    finally:
        sys.setprofile(before)
    return made["text"]


def brief(value: Any) -> str:
    """Return a value in a few words: small arrays whole, large ones as a shape, others by the shapes of their arrays."""
    if isinstance(value, np.ndarray):
        return say(value) if value.size <= 4 else f"{value.shape}"
    if isinstance(value, np.random.Generator):
        return "a generator"
    if isinstance(value, Component):
        return repr(value.kind)
    if attrs.has(type(value)):
        parts = [f"{field.name} {brief(getattr(value, field.name))}" for field in attrs.fields(type(value)) if field.repr]
        return f"{type(value).__name__}({', '.join(parts[:4])}{', ...' if len(parts) > 4 else ''})"
    if isinstance(value, tuple | list):
        return f"({', '.join(map(brief, value[:4]))}{', ...' if len(value) > 4 else ''})"
    return say(value)[:60]


def say(value: Any) -> str:
    """Format a value for a counterexample: arrays as lists, six digits."""
    if isinstance(value, np.ndarray):
        return np.array2string(value, separator=", ", precision=6, threshold=60).replace("\n", "")
    if attrs.has(type(value)):
        fields = [field for field in attrs.fields(type(value)) if field.repr]
        parts = [f"{field.name}={say(getattr(value, field.name))}" for field in fields]
        return f"{type(value).__name__}({', '.join(parts)})"
    if isinstance(value, tuple | list):
        return f"({', '.join(map(say, value))})"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


def shortened(text: str) -> str:
    """Return a line of at most so many characters."""
    line = " ".join(text.split())
    return line if len(line) <= WIDTH else line[: WIDTH - 4] + " ..."


def counterexample(what: str, component: Component, data: Any, check: Callable[[], None]) -> str:
    """Return what is wrong, the last call, the component and the data: four lines."""
    lines = [what.replace("\n", " ")]
    if call := last_call(component, check):
        lines.append(f"  after {shortened(call)}")
    return "\n".join([*lines, f"  with {shortened(say(component))}", f"  and {shortened(say(data))}"])
