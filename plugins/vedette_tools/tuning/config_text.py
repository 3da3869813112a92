"""A tuned config as TOML, which runs as it is, with a comment on each number that was tuned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vedette.config import apply_changes, plain
from vedette_tools import toml_text
from vedette_tools.tuning.summary import summary
from vedette_tools.tuning.tuner import Tuned

WIDE = 100
"""A table that is longer than so many characters gets lines of its own."""


def toml(tuned: Tuned) -> str:
    """Return the config with the tuned values in it, of the form that it had: what it left to defaults stays left."""
    notes: dict[tuple[Any, ...], str] = {}
    for parameter in tuned.parameters:
        inside = parameter.free.place.inside
        path = parameter.free.place.path[: len(parameter.free.place.path) - len(inside)]
        was = "" if parameter.before is None else f", was {parameter.before:.4g}"
        which = "".join(f"[{i}]" for i in inside)
        notes[path] = f"{notes[path]}; " if path in notes else ""
        notes[path] += f"{f'{which}: ' if which else ''}tuned: {summary(parameter)}{was}"
    judged = tuned.judged
    head = [
        f"# {toml_text.comment(tuned.title) or 'A config'}, tuned by {tuned.by} with `vedette tune`.",
        f"# Tuned on the first {judged.tuned} of {len(judged.times)} scans.",
    ]
    if judged.held is not None:
        head.append(f"# Log-likelihood of the others, tuned less before: {judged.held.text}.")
    if judged.advice == "keep":
        head.append("# On those the values before, stated in the comments, are better: keep them.")
    return text_of(tuned.own, tuned.written, notes, head)


def text_of(
    own: Mapping[str, Any], written: Mapping[str, Any], notes: Mapping[tuple[Any, ...], str], head: Sequence[str]
) -> str:
    """Return a config with values written into it, below some lines, with notes beside the values at some paths."""
    config = plain(apply_changes(own, written.items()))
    return "\n".join([*head, "", *_table(config, (), notes)]) + "\n"


def _table(table: Mapping[str, Any], path: tuple[Any, ...], notes: Mapping[tuple[Any, ...], str]) -> Iterator[str]:
    """Yield a table: its values first, then the tables in it that need lines of their own."""
    short = {name: value for name, value in table.items() if not _needs_lines(value, (*path, name), notes)}
    for name, value in short.items():
        note = notes.get((*path, name), "")
        yield f"{toml_text.key(name)} = {toml_text.value(value)}{f'  # {note}' if note else ''}"
    for name, value in table.items():
        if name in short:
            continue
        here = (*path, name)
        if isinstance(value, Mapping):
            if any(not _needs_lines(entry, (*here, inner), notes) for inner, entry in value.items()):
                yield ""
                yield f"[{_path(here)}]"
            yield from _table(value, here, notes)
            continue
        for i, entry in enumerate(value):
            yield ""
            yield f"[[{_path(here)}]]"
            yield from _table(entry, (*here, i), notes)


def _needs_lines(value: Any, path: tuple[Any, ...], notes: Mapping[tuple[Any, ...], str]) -> bool:
    tables = isinstance(value, Mapping) or (
        isinstance(value, list) and len(value) > 0 and all(isinstance(entry, Mapping) for entry in value)
    )
    if not tables:
        return False
    noted = any(len(place) > len(path) and place[: len(path)] == path for place in notes)
    return noted or len(toml_text.value(value)) > WIDE


def _path(path: tuple[Any, ...]) -> str:
    return ".".join(toml_text.key(step) for step in path if isinstance(step, str))
