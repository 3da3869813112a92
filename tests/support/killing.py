"""Commands that are killed at some moment, each in a fork of one process that has loaded all that it needs.

    python -m support.killing KILLS SEED FOLDER run CONFIG --stream
    python -m support.killing KILLS SEED FOLDER study STUDY
    python -m support.killing KILLS SEED FILE export RUN

It runs the command into FOLDER-whole, and then into FOLDER-0, where it is killed at a moment that is drawn, and resumed and
killed until it has ended by itself; then into FOLDER-1, until so many were killed. It prints how often, and the folders.
"""

import os
import random
import signal
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from vedette.cli import main
from vedette_files.results import UNFINISHED
from vedette_report.running import growing
from vedette_report.series import recorder as series

OPTIONS = {"run": "--out", "study": "--out", "export": "--to"}
"""What names the place of a command's results."""


def killed(seconds, command, number=signal.SIGKILL):
    """Run a command in a fork and send it a signal after some time; return its exit code."""
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    child = os.fork()
    if not child:
        with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
            os._exit(main(_begun(command)))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.0005)
    os.kill(child, number)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _begun(command):
    """Yield the words of a command, which hears Ctrl-C from the first on: on a busy machine it came before the command."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    yield from command


def chain(place, seconds, command, chance):
    """Run a command and kill it, and go on with it, until it has ended; return how often it was killed.

    An export has nothing to go on from: a former file stays as it was until the new one is whole.
    """
    kills, code, option = 0, -9, OPTIONS[command[0]]
    while code:
        line = [*command, option, str(place)]
        if command[0] == "run" and list(place.glob(f"{UNFINISHED}*/recording.jsonl")):
            line = ["run", "--resume", str(place)]
        elif command[0] == "study" and (place / "manifest.json").exists():
            line.append("--resume")
        elif command[0] == "export":
            place.write_text("former")
        code = killed(chance.uniform(0.0, seconds), line)
        assert code in (0, -signal.SIGKILL), (code, line)
        assert not code or command[0] != "export" or place.read_text() == "former" or place.stat().st_size > 1000
        kills, seconds = kills + (code != 0), 1.2 * seconds  # so that it ends on a busy machine, too
    return kills


if __name__ == "__main__":
    total, seed, name, *command = sys.argv[1:]
    place = Path(name)
    chance, kills, chains = random.Random(int(seed)), 0, 0
    series.SCANS, growing.BLOCKS = 4, 2
    with redirect_stdout(sys.stderr):
        main(
            [*command, OPTIONS[command[0]], str(place.with_name(f"{place.stem}-first{place.suffix}"))]
        )  # what it loads, the forks have
        begin = time.monotonic()
        main([*command, OPTIONS[command[0]], str(place.with_name(f"{place.stem}-whole{place.suffix}"))])
    seconds = 1.2 * (time.monotonic() - begin)
    while kills < int(total):
        kills += chain(place.with_name(f"{place.stem}-{chains}{place.suffix}"), seconds, command, chance)
        chains += 1
    print(kills, chains)
