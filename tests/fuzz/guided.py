"""Fuzzing guided by coverage: `python -m fuzz.guided --seconds 60`, for whatever reads bytes. Needs Atheris.

Atheris changes the bytes that a reader is given until they reach lines that none had reached, which drawn changes seldom do.
Each target runs in a process of its own, for so many seconds. What escapes, hangs or takes too much memory is told with the
file that repeats it: `python -m fuzz.guided --only config.yaml --again FILE`. Exit code 1 if anything did.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

Read = Callable[[bytes, Path], object]

HANG, MEMORY, LONGEST = 20, 3072, 4096
"""Seconds that a case may take, MiB that a process may, and bytes of a case."""

MODULES = (
    "vedette",
    "vedette_files",
    "vedette_live",
    "vedette_marine",
    "vedette_study",
    "vedette_tools",
    "tomllib",
    "yaml",
    "pyais",
)
EXECUTED = re.compile(r"stat::number_of_executed_units:\s*(\d+)")
REACHED = re.compile(r"cov: (\d+)")


def targets() -> dict[str, tuple[list[bytes], Read]]:
    """Return each target: good bytes to begin with, and what reads bytes in a folder."""
    from fuzz import live, results
    from fuzz.readers import READERS
    from fuzz.samples import FILES
    from vedette.config.overrides import apply_overrides

    def of_results(name: str) -> Read:
        def read(data: bytes, folder: Path) -> object:
            (folder / name).write_bytes(data)
            return results.READ[name][1](folder / name)

        return read

    def of_input(reader: str, file: str, others: dict[str, bytes]) -> Read:
        def read(data: bytes, folder: Path) -> object:
            files = others | {file: data}
            for name, content in files.items():
                (folder / name).parent.mkdir(exist_ok=True)
                (folder / name).write_bytes(content)
            return READERS[reader](folder, files, bool(data[:1] < b"~"))

        return read

    def of_stream(form: Any) -> Read:
        def read(data: bytes, folder: Path) -> object:
            middle = len(data) // 2
            memory = form.decode(form.start(), data[:middle]).memory
            return form.end(form.decode(memory, data[middle:]).memory)

        return read

    def setting(data: bytes, folder: Path) -> object:
        return apply_overrides({"a": {"b": [{"c": 1}]}}, [data.decode("utf-8", "surrogateescape")])

    def planted(data: bytes, folder: Path) -> object:
        if data[:2] == b"!!" and data[2:5] == b"int" and len(data) == 6:
            raise KeyError(data[5:])
        return None

    found: dict[str, tuple[list[bytes], Read]] = {
        name: ([made()], of_results(name)) for name, (made, _) in results.READ.items()
    }
    for reader, made in FILES.items():
        files = dict(made())
        if reader not in ("radar_pictures", "video", "run"):  # OpenCV decodes those
            found |= {f"{reader}.{name}": ([content], of_input(reader, name, files)) for name, content in files.items()}
    found |= {f"stream.{form.kind}": ([good], of_stream(form)) for form, good in live.FORMATS}
    found["set"] = ([b"a.b[0].c=2", b'a.d={x = 1, y = "1 m"}'], setting)
    found["planted"] = ([b"!!float 1e3"], planted)
    return found


def _here(name: str, options: list[str], corpus: Path) -> None:
    """Fuzz one target in this process, which Atheris ends."""
    import atheris
    import numpy as np

    from fuzz.cases import ALLOWED

    good, read = targets()[name]
    for function in {read, *_functions()}:
        atheris.instrument_func(function)
    for i, data in enumerate(good):
        (corpus / f"good{i}").write_bytes(data)
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    with tempfile.TemporaryDirectory() as folder:

        def once(data: bytes) -> None:
            try:
                read(data, Path(folder))
            except ALLOWED as error:
                if not str(error) or len(str(error)) > 100_000:
                    raise AssertionError(f"an error of {len(str(error))} characters") from None

        atheris.Setup([sys.argv[0], *options, str(corpus)], once)
        atheris.Fuzz()


def _functions() -> Iterator[FunctionType]:
    """Yield all functions of what is fuzzed: Atheris' own hook at import misses modules of an editable installation."""
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] in MODULES:
            for value in vars(module).values():
                members = vars(value).values() if isinstance(value, type) else [value]
                functions = (getattr(member, "__func__", member) for member in members)
                yield from (item for item in functions if isinstance(item, FunctionType) and item.__module__ == name)


def fuzz(name: str, seconds: int, seed: int, kept: Path) -> tuple[int, int, str]:
    """Fuzz one target in a process of its own; return how many cases there were, what they reached, and what was found."""
    options = [f"-max_total_time={seconds}", f"-seed={seed + 1}", f"-timeout={HANG}", f"-rss_limit_mb={MEMORY}"]
    options += [f"-max_len={LONGEST}", "-print_final_stats=1", f"-artifact_prefix={kept}/{name}-"]
    with tempfile.TemporaryDirectory() as corpus:
        command = [sys.executable, "-m", "fuzz.guided", "--only", name, "--here", corpus, "--", *options]
        where = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, env=where)
    told = done.stdout + done.stderr
    cases, reached = EXECUTED.search(told), REACHED.findall(told)
    wrong = "" if done.returncode == 0 else told[-3000:]
    return int(cases[1]) if cases else 0, int(reached[-1]) if reached else 0, wrong


def main() -> int:
    """Fuzz all targets, one of them, or one case again."""
    parser = argparse.ArgumentParser("fuzz.guided", description=__doc__)
    parser.add_argument("--seconds", type=int, default=60, help="for each target")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", help="one target")
    parser.add_argument("--keep", default=".", help="where the bytes of what is found go")
    parser.add_argument("--again", help="a file of bytes that --only reads once, with its traceback")
    parser.add_argument("--here", help=argparse.SUPPRESS)
    parser.add_argument("options", nargs="*", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.here:
        _here(given.only, given.options, Path(given.here))
    if given.again:
        with tempfile.TemporaryDirectory() as folder:
            print(targets()[given.only][1](Path(given.again).read_bytes(), Path(folder)))
        return 0
    worst = 0
    for name in [given.only] if given.only else [name for name in targets() if name != "planted"]:
        cases, reached, wrong = fuzz(name, given.seconds, given.seed, Path(given.keep))
        print(
            f"{name}: {cases:,} cases reached {reached:,} places{wrong and ': something escaped'}\n{wrong}".rstrip(),
            flush=True,
        )
        worst = max(worst, int(bool(wrong)))
    return worst


if __name__ == "__main__":
    sys.exit(main())
