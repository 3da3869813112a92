"""`vedette serve`: a tracker that takes what comes until it is stopped."""

from __future__ import annotations

import json
import logging
import signal
import sys
from argparse import Namespace
from threading import current_thread, main_thread
from typing import Any, final

from vedette.commands import DONE, options
from vedette.streams import now
from vedette_live.config import load_service
from vedette_live.log import LOG
from vedette_live.running import Running

_USUAL = frozenset(vars(logging.makeLogRecord({})))


def run(arguments: Namespace) -> int:
    """Serve until a signal, or until all inputs have ended."""
    service = load_service(arguments.config, options.overrides(arguments))
    if arguments.check:
        print(f"{arguments.config}: {len(service.parts.inputs)} inputs, {len(service.parts.outputs)} outputs: can be served")
        return DONE
    _log_as_json()
    running = Running(service)
    if current_thread() is main_thread():
        for name in ("SIGTERM", "SIGINT", "SIGHUP"):
            number = getattr(signal, name, signal.SIGTERM)  # Windows has no SIGHUP
            if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup has it
                signal.signal(number, lambda *_: running.end())
    running.run()
    counts = running.counters.counts
    if arguments.json:
        print(json.dumps({**counts, "latency": running.counters.latency()}))
    return DONE


def _log_as_json() -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Lines())
    LOG.handlers = [handler]
    LOG.setLevel(logging.INFO)
    LOG.propagate = False


@final
class _Lines(logging.Formatter):
    """A line of JSON an event: nothing that came from outside can begin a line of its own."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        more: dict[str, Any] = {name: value for name, value in vars(record).items() if name not in _USUAL}
        if record.exc_info is not None:
            more["trace"] = self.formatException(record.exc_info)
        event = {"time": round(now(), 3), "level": record.levelname.lower(), "event": record.getMessage(), **more}
        return json.dumps(event, default=str)
