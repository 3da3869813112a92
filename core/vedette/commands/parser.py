"""Arguments of the command line; what is misspelled gets the word that was meant."""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, final

if TYPE_CHECKING:
    from vedette.supporting import Command

_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)")


@final
class Parser(ArgumentParser):
    """Reports wrong use with the usage of the command that it concerns, and with what was probably meant."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.below: dict[str, Parser] = {}
        self.commands: dict[str, Command] = {}
        self.why_missing: Callable[[str], list[str]] = lambda _: []

    def given(self, arguments: Sequence[str]) -> Namespace:
        """Return the arguments; SystemExit for --help, --version and wrong use."""
        parsed, unknown = self.parse_known_args(arguments)
        if unknown:
            command = self.below.get(parsed.command, self)
            command.error(f"unknown: {' '.join(unknown)}{command.meant(unknown[0])}")
        return parsed

    def meant(self, option: str) -> str:
        """Return the nearest of this command's options, as a question; "" if none is near."""
        return _nearest(option.partition("=")[0], self._option_string_actions)

    def error(self, message: str) -> NoReturn:
        """End with the usage and what is wrong; beside a wrong choice stands the nearest right one."""
        if wrong := _CHOICE.search(message):
            unused = "; ".join(self.why_missing(wrong[1]))
            message += f"; {unused}" if unused else _nearest(wrong[1], re.findall(r"\w+", wrong[2])) or _of_data(wrong[1])
        super().error(message)


def _nearest(word: str, known: Sequence[str] | dict[str, Any]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(word, known, n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _of_data(word: str) -> str:
    return f"; `vedette new config {word}` drafts a config for it" if word.endswith((".csv", ".parquet")) else ""
