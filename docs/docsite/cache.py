"""Outputs and pictures of pages, kept by a hash of everything that they follow from."""

import hashlib
import json
import os
import shutil
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import distributions
from pathlib import Path
from tempfile import TemporaryDirectory

from docsite.pages import PACES, PICTURE, ROOT, blocks
from docsite.runner import DRIVER, Ran, pages_folder, run, why_not

KEPT = ROOT / ".cache" / "docsite"


@cache
def _installation() -> str:
    """Return a hash of Vedette's sources, its examples, the runner, and the versions of all that is installed."""
    digest = hashlib.sha256()
    files = [path for folder in ("core", "plugins", "simulators", "examples") for path in sorted((ROOT / folder).rglob("*"))]
    files += [DRIVER.with_name(name) for name in ("driver.py", "pages.py", "runner.py")]
    for path in files:
        if path.suffix in (".py", ".cpp", ".h", ".hpp", ".toml", ".js", ".css"):
            digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    digest.update(str(sorted(f"{one.name} {one.version}" for one in distributions())).encode())
    digest.update(sys.version.encode() + str("VEDETTE_DATA" in os.environ).encode())
    return digest.hexdigest()


def _kept(page: Path, pace: str) -> Path:
    """Return where the outputs of a page at a pace are kept."""
    text = page.read_text(encoding="utf-8")
    its = [[b.language, b.code, b.title, b.reason, b.into, b.printed, why_not(b, pace)] for b in blocks(text)]
    told = json.dumps([[match["file"] for match in PICTURE.finditer(text)], page.name, its])
    return KEPT / hashlib.sha256((_installation() + told).encode()).hexdigest()[:32]


def _keep(folder: Path, ran: list[Ran], page: Path, drawn: Path) -> None:
    """Keep what became of a page's blocks, at once or not at all: several processes may do so at a time."""
    numbers = {block.line: i for i, block in enumerate(blocks(page.read_text(encoding="utf-8")))}
    plain = [[numbers[r.block.line], r.state, r.printed, r.pictures, r.took] for r in ran]
    KEPT.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=KEPT) as made:
        whole = Path(made) / "whole"
        (whole / "pictures").mkdir(parents=True)
        if drawn.exists():
            shutil.copytree(drawn, whole / "pictures", dirs_exist_ok=True)
        (whole / "ran.json").write_text(json.dumps(plain), encoding="utf-8")
        with suppress(OSError):  # another process has kept it
            whole.rename(folder)


def outputs(pages: Sequence[Path], pace: str, pictures: Path | None = None, at_once: int = 1) -> dict[Path, list[Ran]]:
    """Return what became of the blocks of pages, run now or kept, and put each page's pictures into a folder in `pictures`.

    What was kept at a slower pace has more than is asked for, and is taken.
    """
    paces = PACES[PACES.index(pace) :]
    found = {page: next((at for slower in paces if (at := _kept(page, slower)).exists()), None) for page in pages}
    with TemporaryDirectory() as folder:
        lacking = [page for page, at in found.items() if at is None]
        faulty = {}
        for page, ran in run(lacking, Path(folder), pace, at_once).items():
            if any(one.fault for one in ran):
                faulty[page] = ran
            else:
                found[page] = _kept(page, pace)
                _keep(found[page], ran, page, Path(folder) / pages_folder(page))
    return {page: faulty[page] if at is None else _read(page, at, pictures) for page, at in found.items()}


def _read(page: Path, kept: Path, pictures: Path | None) -> list[Ran]:
    """Return what is kept of a page, and copy its pictures."""
    its = blocks(page.read_text(encoding="utf-8"))
    for picture in sorted((kept / "pictures").glob("*")) if pictures else ():
        target = pictures / pages_folder(page) / picture.name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(picture, target)
    stored = json.loads((kept / "ran.json").read_text(encoding="utf-8"))
    return [Ran(its[i], state, said, tuple(map(tuple, drawn)), took) for i, state, said, drawn, took in stored]
