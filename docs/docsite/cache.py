"""Outputs and pictures of pages, kept by a hash of everything that they follow from."""

import hashlib
import json
import os
import shutil
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

from docsite.pages import PICTURE, ROOT, blocks
from docsite.runner import DRIVER, Ran, run

KEPT = ROOT / ".cache" / "docsite"


@cache
def _installation() -> str:
    """Return a hash of Vedette's sources, its examples, and the versions of what computes and draws."""
    digest = hashlib.sha256(DRIVER.read_bytes())
    for folder in ("core", "plugins", "simulators", "examples"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".cpp", ".h", ".hpp", ".toml", ".js", ".css"):
                digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    for name in ("numpy", "scipy", "matplotlib"):
        digest.update(version(name).encode())
    digest.update(sys.version.encode() + str("VEDETTE_DATA" in os.environ).encode())
    return digest.hexdigest()


def outputs(page: Path, folder: Path) -> list[Ran]:
    """Return what became of a page's blocks, slow ones too, and put its pictures into `folder`."""
    its = blocks(page.read_text(encoding="utf-8"))
    keep = [match["file"] for match in PICTURE.finditer(page.read_text(encoding="utf-8"))]
    told = json.dumps([keep, page.name, *([b.language, b.code, b.title, b.reason, b.into, b.printed] for b in its)])
    kept = KEPT / hashlib.sha256((_installation() + told).encode()).hexdigest()[:32]
    if not (kept / "ran.json").exists():
        shutil.rmtree(kept, ignore_errors=True)
        ran = run([page], kept / "pictures", nightly=True)[page]
        if any(one.fault for one in ran):
            return ran
        numbers = {block.line: i for i, block in enumerate(its)}
        plain = [[numbers[r.block.line], r.state, r.printed, r.pictures, r.took] for r in ran]
        kept.mkdir(parents=True, exist_ok=True)
        (kept / "ran.json").write_text(json.dumps(plain), encoding="utf-8")
    for picture in sorted((kept / "pictures").glob("*/*")):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(picture, folder / picture.name)
    stored = json.loads((kept / "ran.json").read_text(encoding="utf-8"))
    return [Ran(its[i], state, said, tuple(map(tuple, drawn)), took) for i, state, said, drawn, took in stored]
