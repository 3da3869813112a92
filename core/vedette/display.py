"""How values show themselves in a notebook: small tables of HTML."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

import attrs
import numpy as np

LONGEST = 80
"""Characters of a value; a longer one is cut."""


_IN_ADDRESS = re.compile(r"(?<=://)([^\s/?#:@]*):[^\s/?#]*@")
"""User and password before a host: what stands between // and the last @ before a slash."""

_IN_QUERY = re.compile(r"(?<=[?&/])((?:pass(?:word|wd)?|pwd|token|secret|api_?key)=)[^\s&\"'#]+", re.IGNORECASE)
"""A password among the parameters of an address: many cameras take it so."""


def about(cls: type) -> str:
    """Return what the docstring of a class says."""
    return inspect.cleandoc(cls.__doc__ or "")


def without_passwords(text: str) -> str:
    """Return a text with *** in the place of the passwords that stand in addresses, as in rtsp://user:password@host."""
    return _IN_QUERY.sub(r"\1***", _IN_ADDRESS.sub(r"\1:***@", text))


def html_table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of two columns under a title."""
    lines = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption>{escape(title)}</caption><tbody>{lines}</tbody></table>"


def named(value: Any) -> str:
    """Return a component by its kind, else a value in short."""
    kind = getattr(value, "kind", None)
    if isinstance(kind, str):
        inner = [named(part) for part in _parts(value)]
        return kind + (f"({', '.join(inner)})" if inner else "")
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {named(item)}" for name, item in value.items()) or "none"
    if isinstance(value, tuple | list):
        return ", ".join(named(item) for item in value) or "none"
    if isinstance(value, np.ndarray):
        return str(value.tolist())
    return f"{value:.6g}" if isinstance(value, float) else "none" if value is None else without_passwords(str(value))


def shown(value: Any) -> str:
    """Return a value in short, cut where it is long."""
    text = named(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def parameters_html(value: Any) -> str:
    """Return the table of an attrs value's parameters with their units."""
    rows = []
    for field in attrs.fields(type(value)):
        if field.init and not field.name.startswith("_"):
            unit = str(field.metadata.get("unit", ""))
            rows.append((field.name, f"{shown(getattr(value, field.name))} {'' if unit in ('', '1') else unit}".strip()))
    return html_table(getattr(value, "kind", type(value).__name__), rows)


def _parts(value: Any) -> list[Any]:
    """Return the components among a component's parameters."""
    fields = [field.name for field in attrs.fields(type(value)) if field.init] if attrs.has(type(value)) else []
    values = [getattr(value, name) for name in fields]
    flat = [item for part in values for item in (part if isinstance(part, tuple | list) else [part])]
    return [item for item in flat if isinstance(getattr(item, "kind", None), str)]
