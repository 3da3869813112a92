"""The commands of live runs: their options; the module of each does the work."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import ClassVar, final

from attrs import frozen

from vedette import Command
from vedette.commands import options


@final
@frozen
class Serve(Command):
    """Track what comes from sockets, files that grow or brokers, until it is stopped.

    The config is that of `vedette run` with [[inputs]] in the place of [source], and [[outputs]]. What happens is told as
    lines of JSON on standard error. SIGTERM and Ctrl-C end it in order: what waits is taken, the state is saved.
    """

    kind: ClassVar[str] = "serve"

    def options(self, parser: ArgumentParser) -> None:
        options.add_config(parser)
        options.add_seed(parser)
        parser.add_argument("--check", action="store_true", help="read the config and stop: what it says can be served")
        options.add_json(parser, "end standard output with one line of JSON: what was counted")

    def run(self, arguments: Namespace) -> int:
        from vedette_live.commands import serve

        return serve.run(arguments)


@final
@frozen
class Replay(Command):
    """Send recordings as they came: each scan at its time, as JSON lines, to a socket or to standard output.

    The files are recordings of Vedette's, as a run leaves one in its folder and a service some, as record.jsonl and
    record-2.jsonl: one is sent after the other, without the pause between them. Scans are numbered from 0, over all.
    """

    kind: ClassVar[str] = "replay"

    def options(self, parser: ArgumentParser) -> None:
        parser.add_argument("files", metavar="FILE", nargs="+", help="a recording as JSON lines")
        parser.add_argument(
            "--to", default="-", metavar="ADDRESS", help="udp://HOST:PORT, tcp://HOST:PORT, or - for standard output"
        )
        parser.add_argument("--speed", metavar="X", help="times as fast as recorded, or max: without a pause; default: 1")

    def run(self, arguments: Namespace) -> int:
        from vedette_live.commands import replay

        return replay.run(arguments)
