"""TOML, YAML and JSON as plain data, in time and memory that grow with the text and no faster."""

from __future__ import annotations

import json
import re
from typing import Any

from vedette.limits import DEEPEST, most

MOST_NODES = 200_000
"""Values and names in a YAML text, once merged: a tree of them takes 1 kB each."""

_PLACE = re.compile(r"line (\d+), column (\d+)")
_BARE = re.compile(r"([-+]?)(\.\d+)")
"""A number without a digit before its point, which TOML takes for none."""

_DOTTED = re.compile(rf"""(?:["']?[\w-]++["']?[ \t]*+\.[ \t]*+){{{DEEPEST + 1}}}""")
"""A name of more parts than tables may be deep: TOML's reader takes time that grows with their square."""

_RAISED = (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError, ArithmeticError)
"""What readers raise for text that their own checks miss, as for `!!int ""`."""


def toml(text: str) -> Any:
    """Return what a TOML text says; ValueError if it is none."""
    import tomllib

    if deep := _DOTTED.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise ValueError(f"a name is nested deeper than {DEEPEST} levels (at line {line})")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        bare = place and _BARE.match(text.split("\n")[int(place[1]) - 1], int(place[2]) - 1)
        raise ValueError(f"{error}: write {bare[1]}0{bare[2]}, not {bare[0]}" if bare else str(error)) from None
    except _RAISED as error:
        raise ValueError(f"a value cannot be read: {error}") from None


def json_text(text: str) -> Any:
    """Return what a JSON text says; ValueError if it is none, or a name is twice in one table."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table: dict[str, Any] = {}
        for name, value in pairs:
            if name in table:
                raise ValueError(f"{name[:60]!r} appears twice in one table")
            table[name] = value
        return table

    return json.loads(text, object_pairs_hook=once)


def yaml_text(text: str) -> Any:
    """Return what a YAML text says, its merges made; ValueError if it is none or has more than MOST_NODES values."""
    import yaml  # type: ignore[import-untyped]

    reader, limit = getattr(yaml, "CSafeLoader", yaml.SafeLoader), most(MOST_NODES)
    count = depth = 0
    try:
        for event in yaml.parse(text, Loader=reader):  # before nodes are made of them, in C by recursion
            count += isinstance(event, yaml.NodeEvent)
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST + 1:
                raise RecursionError
            if count > limit:
                raise ValueError(f"holds more than {limit:,} values")
        loader = reader(text)
        try:
            node = loader.get_single_node()
            _MergedTables(yaml.MappingNode, limit).check(node)
            return None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        if "nesting depth" in str(error):  # what the parser in C itself says beyond a limit of its own
            raise RecursionError from None
        raise ValueError(" ".join(str(error).split())) from None
    except ValueError:
        raise
    except _RAISED as error:
        raise ValueError(f"a value cannot be read: {' '.join(str(error).split()) or type(error).__name__}") from None


class _MergedTables:
    """What `<<` makes of tables, counted before it is made: merged tables that merge others double with each line."""

    def __init__(self, mapping: Any, limit: int) -> None:
        self._mapping, self._limit, self._total = mapping, limit, 0
        self._sizes: dict[int, int] = {}

    def check(self, node: Any) -> int:
        """Return the names that a table has once merged. ValueError for a name that is twice in one, or too many in all."""
        if id(node) in self._sizes or not isinstance(getattr(node, "value", None), list):
            return self._sizes.get(id(node), 0)
        self._sizes[id(node)] = 0  # while it is looked at: a table may be within itself
        size = 0
        if isinstance(node, self._mapping):
            names: set[str] = set()
            for name, value in node.value:
                if isinstance(name.value, str):
                    if name.value in names:
                        mark = f"{node.start_mark}".replace("\n", " ")
                        raise ValueError(f"{name.value[:60]!r} appears twice in one table, {mark}")
                    names.add(name.value)
                self.check(name)
                nodes = self.check(value)
                merges = name.tag == "tag:yaml.org,2002:merge"
                parts = value.value if merges and not isinstance(value, self._mapping) else ()
                size += nodes + sum(self._sizes.get(id(part), 0) for part in parts) if merges else 1
        else:
            for part in node.value:
                self.check(part)
        self._sizes[id(node)] = size
        self._total += size
        if self._total > self._limit:
            raise ValueError(f"holds more than {self._limit:,} values, once its merges are made")
        return size
