"""The command `vedette`: its arguments and how it ends. docs/command-line.md describes it.

Exit codes: 0 done; 1 a law failed (`check`);
2 wrong use, config or input, reported without a traceback; 130 interrupted; 141 the reader closed the pipe.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, final

from vedette.commands.exit_codes import CLOSED, INTERRUPTED, complain, ended
from vedette.errors import VedetteError
from vedette.limits import FACTOR, most

if TYPE_CHECKING:
    from vedette.supporting import Command

_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code. SystemExit only from argparse: for --help, --version and wrong use."""
    _open_streams()
    if arguments is None:
        # a process of its own makes few cycles, and looking for them among all that is imported is a tenth of a short run
        gc.set_threshold(100_000, 20, 20)
    traceback, foreign = False, None
    try:
        parser = _parser()
        parsed = parser.given(_values_joined(sys.argv[1:] if arguments is None else arguments))
        traceback = parsed.traceback
        if parsed.limits is not None:
            os.environ[FACTOR] = parsed.limits
            most(1)
        foreign = parsed.foreign
        code = parser.commands[parsed.command].run(parsed)
        sys.stdout.flush()
    except VedetteError as error:
        return ended(error, str(error), traceback=traceback)
    except BrokenPipeError:
        _forget_stdout()
        return CLOSED
    except UnicodeEncodeError as error:
        part = ascii(error.object[error.start : error.end])
        return complain(f"{part} cannot be written in {error.encoding}: a name in another encoding? LANG=C.UTF-8 reads more")
    except OSError as error:
        return complain(f"{error.filename or 'a file or the output'}: {error.strerror or error}")
    except (Exception, KeyboardInterrupt, SystemExit) as error:
        if KeyboardInterrupt in (type(error), type(error.__context__)):  # some libraries raise over it, as zipfile does
            print("vedette: interrupted", file=sys.stderr)
            return INTERRUPTED
        from vedette.tracking.faults import raised_by

        # a component that ends the process is told as one that raises, but for a command, which may
        if (text := raised_by(error, None, foreign if isinstance(error, Exception) else None)) is None:
            raise
        return ended(error, text, traceback=traceback)
    return code


def _values_joined(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `--origin -33.8,151.2` as one: argparse takes what begins with a minus for an option."""
    joined = [""]
    for argument in arguments:
        if joined[-1].startswith("--") and "=" not in joined[-1] and argument[:1] == "-" and argument[1:2].isdigit():
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined[1:]


def _open_streams() -> None:
    """Write nowhere what is meant for a stream that the caller has closed."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115


def _forget_stdout() -> None:
    """Write nowhere from now on: the reader closed the pipe, as `| head` does, and nothing is wrong."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):
        return


def _parser() -> Parser:
    """Return the parser of all commands that plugins bring, each with its own options."""
    from vedette import display
    from vedette.config.registry import Registry  # which says in a line if the kernels asked for cannot be had

    parser = Parser("vedette", description="Compose target trackers from small parts and run them.")
    parser.add_argument(
        "--version", action="version", version=f"vedette {version('vedette')}", help="show the version and exit"
    )
    parser.add_argument("--traceback", action="store_true", help="show where in the code an error came from")
    parser.add_argument("--limits", metavar="FACTOR", help="multiply the limits on what is read by FACTOR, at least 1")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    registry = Registry.installed()
    parser.below, parser.why_missing = commands.choices, registry.unused
    for entry in registry.of_role("command"):
        command: Any = entry.cls()
        summary = entry.summary.rstrip(".").replace("%", "%%")
        about = display.about(entry.cls).replace("%", "%%")
        below = commands.add_parser(entry.kind, help=summary[:1].lower() + summary[1:], description=about)
        try:
            command.options(below)
        except (Exception, SystemExit) as error:  # a third party's: the other commands go on
            complain(f"the command {entry.kind!r} of {entry.bringer} cannot be used: its `options` failed: {error!r}")
        below.set_defaults(parser=parser, foreign=None if entry.distribution == "vedette" else command)
        parser.commands[entry.kind] = command
    return parser


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
