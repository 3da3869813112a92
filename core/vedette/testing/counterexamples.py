"""What a counterexample says: the call that was made, with shapes, the component and the data, each in a line."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import suppress
from traceback import walk_tb
from types import FrameType
from typing import Any

import attrs
import numpy as np

from vedette.roles import Component
from vedette.tracking.faults import watched_by

WIDTH = 240
"""Characters of a line, at most."""


def way_of(error: BaseException) -> tuple[str, str]:
    """Return the outermost method of a component on an error's way, to begin a sentence, and the line in the innermost."""
    way = [(at, line) for at, line in walk_tb(error.__traceback__) if isinstance(at.f_locals.get("self"), Component)]
    if not way:
        return "", ""
    (first, _), (last, line) = way[0], way[-1]
    return f"{first.f_locals['self'].kind}.{first.f_code.co_name} ", f" ({last.f_code.co_filename}:{line})"


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

    with watched_by(watch), suppress(Exception):  # it fails again: that is what it is run for
        check()
    return made["text"]


def brief(value: Any) -> str:
    """Return a value in a few words: small arrays whole, large ones as a shape, others by the shapes of their arrays."""
    if isinstance(value, np.ndarray):
        return say(value, 6) if value.size <= 4 else f"{value.shape}"
    if isinstance(value, np.random.Generator):
        return "a generator"
    if isinstance(value, Component):
        return repr(value.kind)
    if attrs.has(type(value)):
        parts = [f"{field.name} {brief(getattr(value, field.name))}" for field in attrs.fields(type(value)) if field.repr]
        return f"{type(value).__name__}({', '.join(parts[:4])}{', ...' if len(parts) > 4 else ''})"
    if isinstance(value, tuple | list):
        return f"({', '.join(map(brief, value[:4]))}{', ...' if len(value) > 4 else ''})"
    return say(value, 6)[:60]


def say(value: Any, digits: int | None = None) -> str:
    """Return a value as Python code that makes it again: each number exact, or of so many digits where it is only read."""
    if isinstance(value, np.ndarray):
        if digits is not None:
            return np.array2string(value, separator=", ", precision=digits, threshold=60).replace("\n", "")
        return f"np.array({value.tolist()!r})" if value.size <= 600 else f"np.zeros({value.shape})"
    if attrs.has(type(value)):
        fields = [field for field in attrs.fields(type(value)) if field.repr and field.init]
        parts = [f"{field.alias or field.name}={say(getattr(value, field.name), digits)}" for field in fields]
        return f"{type(value).__name__}({', '.join(parts)})"
    if isinstance(value, tuple | list):
        inner = ", ".join(say(each, digits) for each in value)
        ends = "[]" if isinstance(value, list) else "()"
        return f"{ends[0]}{inner}{',' if ends == '()' and len(value) == 1 else ''}{ends[1]}"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {say(each, digits)}' for key, each in value.items())}}}"
    if isinstance(value, float):
        return repr(float(value)) if digits is None else f"{value:.{digits}g}"
    return repr(value)


def shortened(text: str) -> str:
    """Return a line of at most so many characters."""
    line = " ".join(text.split())
    return line if len(line) <= WIDTH else line[: WIDTH - 4] + " ..."


def counterexample(what: str, pair: tuple[Any, ...], check: Callable[[], None] | None) -> str:
    """Return what is wrong, the last call, the component as code, and the data: four lines."""
    (component, data), lines = pair, [what.replace("\n", " ")]
    if check is not None and (call := last_call(component, check)):
        lines.append(f"  after {shortened(call)}")
    exact = say(data)  # which can be pasted; `--replay` repeats what is too long for that
    return "\n".join(
        [*lines, f"  with {say(component)}", f"  and {exact if len(exact) <= WIDTH else shortened(say(data, 6))}"]
    )
