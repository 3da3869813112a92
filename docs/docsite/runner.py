"""Run the code blocks of a page as a reader would: pasted in order into an empty folder."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from attrs import frozen

from docsite.pages import DOCS, PACES, PICTURE, ROOT, Block, agrees, blocks

DRIVER = Path(__file__).with_name("driver.py")
INSTALLS = re.compile(r"\bpip3? install\b")
LONGEST = 1800.0  # s, of one page


@frozen
class Ran:
    """A block with what became of it: what it printed, its pictures (file, title), its CPU time [s], and any fault."""

    block: Block
    state: str  # "ran", "saved", "tried", "read", "not run", "slow", "nightly", "no recordings", "not installed", ..
    printed: str = ""
    pictures: tuple[tuple[str, str], ...] = ()
    took: float = 0.0
    fault: str | None = None


def run(pages: Sequence[Path], pictures: Path | None = None, pace: str = "fast", at_once: int = 1) -> dict[Path, list[Ran]]:
    """Return what became of each block of pages: of those of this pace and of faster ones.

    At the pace "nightly" each page has a fresh interpreter, otherwise a fork of one that has imported Vedette. So many
    pages run `at_once`. Pictures go to `pictures`, into a folder for each page.
    """
    found = {page: blocks(page.read_text(encoding="utf-8")) for page in pages}
    with TemporaryDirectory() as folder:
        jobs = {}
        for i, (page, its) in enumerate(found.items()):
            steps = [_step(page, block) for block in its if why_not(block, pace) is None and _do(block)]
            if steps:
                job = _job(Path(folder) / str(i), steps, pictures and pictures / pages_folder(page))
                keep = [match["file"] for match in PICTURE.finditer(page.read_text(encoding="utf-8"))]
                jobs[page] = job | {"keep": keep}
        together = hasattr(os, "fork") and pace != "nightly"
        some = [list(jobs.values())] if together else [[job] for job in jobs.values()]
        with ThreadPoolExecutor(at_once) as drivers:
            list(drivers.map(lambda i: _drive(Path(folder) / f"{i}.json", some[i], at_once), range(len(some))))
        results = {page: _results(job) for page, job in jobs.items()}
    return {
        page: [_judged(block, why_not(block, pace), results.get(page, {})) for block in its if _do(block) or block.reason]
        for page, its in found.items()
    }


def pages_folder(page: Path) -> str:
    """Return the name of the folder with a page's pictures."""
    return page.stem if page.is_relative_to(DOCS) and page.parent == DOCS else f"{page.parent.name}-{page.stem}"


def _do(block: Block) -> str | None:
    """Return what to do with a block; None for those that are only looked at."""
    if block.title is not None:
        return "save"
    if block.runs and INSTALLS.search(block.code):
        return "install"
    if block.runs:
        return block.language
    if block.into is not None:
        return "merge"
    return {"json": "read", "toml": "unnamed", "yaml": "unnamed", "csv": "unnamed"}.get(block.language)


def why_not(block: Block, pace: str) -> str | None:
    """Return why a block is not run here at this pace, as the state of its `Ran`, or None."""
    if block.reason is not None:
        return "not run"
    if PACES.index(block.pace) > PACES.index(pace):
        return block.pace
    if block.needs is not None and find_spec(block.needs) is None:
        return "not installed"
    if block.needs_recordings and block.runs and "VEDETTE_DATA" not in os.environ:
        return "no recordings"
    return None


def _step(page: Path, block: Block) -> dict[str, Any]:
    named = {"page": page.name, "line": block.line, "code": block.code, "printed": block.printed}
    return named | {"do": _do(block), "title": block.title, "into": block.into, "language": block.language}


def _job(folder: Path, steps: list[dict[str, Any]], pictures: Path | None) -> dict[str, Any]:
    """Lay out what runs a page."""
    desk = laid_out(folder, (f"{step['code']} {step['into']}" for step in steps))
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
    return {
        "desk": str(desk),
        "results": str(folder / "results.json"),
        "pictures": pictures and str(pictures),
        "steps": steps,
    }


def laid_out(folder: Path, code: Iterable[str]) -> Path:
    """Return the empty folder of a page in another, with the examples if its code names them."""
    desk = folder / "desk"
    desk.mkdir(parents=True)
    if any("examples/" in each for each in code):
        shutil.copytree(ROOT / "examples", desk / "examples", ignore=shutil.ignore_patterns("__pycache__"))
    return desk


def _drive(file: Path, jobs: list[dict[str, Any]], at_once: int) -> None:
    if not jobs:
        return
    file.write_text(json.dumps({"jobs": jobs, "at_once": at_once}), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, str(DRIVER), str(file)],
        cwd=file.parent,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    if ended.returncode:
        raise RuntimeError(f"{jobs[0]['steps'][0]['page']}: its blocks could not be run:\n{ended.stderr}")


def _results(job: dict[str, Any]) -> dict[int, dict[str, Any]]:
    """Return what the driver tells of each step, by the line of its block."""
    told = Path(job["results"])
    if not told.exists():
        return {}
    return {one["line"]: one for one in json.loads(told.read_text(encoding="utf-8"))}


def environment() -> dict[str, str]:
    """Return the environment of a reader who has installed Vedette, on one thread and without a screen."""
    own = {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])}
    quiet = {
        "MPLBACKEND": "Agg",
        "OPENBLAS_NUM_THREADS": "1",
        "COLUMNS": "120",
        "NO_COLOR": "1",
        "PYTHONIOENCODING": "utf-8",
    }
    dropped = ("PYTHONPATH", "PYTEST_CURRENT_TEST", "PYTEST_XDIST_WORKER")
    return {name: value for name, value in os.environ.items() if name not in dropped} | quiet | own


def _judged(block: Block, why_not: str | None, results: dict[int, dict[str, Any]]) -> Ran:
    if why_not is not None:
        return Ran(block, why_not)
    if block.line not in results:
        return Ran(block, "not reached", fault=None if results else "the page's process ended")
    result = results[block.line]
    pictures = tuple((one["file"], one["title"]) for one in result["pictures"])
    fault = None
    if block.printed is not None and not agrees(block.printed, result["printed"]):
        fault = f"the page says that it prints\n{block.printed}\nbut it prints\n{result['printed']}"
    elif block.printed is None and result["error"]:
        fault = result["error"] if result["error"] in result["printed"] else f"{result['error']}\n{result['printed']}"
    states = {"save": "saved", "merge": "tried", "read": "read"}
    return Ran(block, states.get(str(_do(block)), "ran"), result["printed"], pictures, result["took"], fault)


def faults(page: Path, ran: Iterable[Ran]) -> list[str]:
    """Return a line for each block that does not do what its page says."""
    return [f"{page.name}, line {one.block.line}: {one.fault}" for one in ran if one.fault]
