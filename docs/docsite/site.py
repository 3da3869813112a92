"""Lay out the pages with what their blocks print and draw, add the references, and render the site."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from os.path import normpath, relpath
from pathlib import Path
from typing import Any

import yaml
from markdown.extensions.toc import slugify

from docsite import built, charts, links, navigation, notebooks, reference
from docsite.cache import outputs
from docsite.pages import DOCS, PICTURE, ROOT, pages
from docsite.runner import Ran, faults, pages_folder

OUT = ROOT / ".site"
PAGES, HTML = OUT / "pages", OUT / "html"
ELSEWHERE = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
ELSEWHERE |= {"examples": "examples.md"}
_LINK = re.compile(r"(?P<before>!?\[(?:[^\[\]]|\[[^\]]*\])*\]\()(?P<target>[^)\s]+)\)")
MOST_LINES = 60
PICTURES = (".svg", ".png")
UNSEARCHED = "---\nsearch:\n  exclude: true\n---\n\n"


def build(pace: str = "nightly") -> int:
    """Build the site; return 1, saying why, if a block, a link or a page's place is wrong.

    Blocks that are slower than `pace` are not run: what they print is then missing.
    """
    shutil.rmtree(OUT, ignore_errors=True)
    PAGES.mkdir(parents=True)
    written = {"kinds/": reference.kinds(PAGES), "api/": reference.api(PAGES, public())}
    committed = navigation.committed()
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    hand = navigation.expanded(config["nav"], committed, {})
    wrong = navigation.misplaced(hand, committed)
    config["nav"] = navigation.expanded(config["nav"], committed, written)
    ran = outputs(pages(), pace, PAGES / "pictures", at_once=2)
    wrong += [fault for page, its in ran.items() for fault in faults(page, its)]
    if wrong:
        print(*wrong, sep="\n", file=sys.stderr)
        return 1
    for name, page in {**committed, **navigation.measured()}.items():
        _lay_out(name, page, ran.get(page, []))
    _files()
    (OUT / "mkdocs.yml").write_text(yaml.safe_dump(config, sort_keys=False, allow_unicode=True), encoding="utf-8")
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean", "--config-file", str(OUT / "mkdocs.yml")]
    found = os.environ | {"PYTHONPATH": str(DOCS), "NO_COLOR": "1"}  # docsite.shapes
    ended = subprocess.run(command, cwd=OUT, check=False, capture_output=True, text=True, env=found)
    told = re.sub(r"\x1b\[[\d;]*m", "", ended.stdout + ended.stderr).partition("Traceback")[0]
    print(told)
    if ended.returncode or re.search(r"\bwarning\b|^griffe: ", told, re.IGNORECASE | re.MULTILINE):
        return 1
    found_by = HTML / "search.json"
    found_by.write_text(json.dumps(guides_first(json.loads(found_by.read_text(encoding="utf-8")))), encoding="utf-8")
    dead = links.dead(HTML)
    print(*dead, sep="\n", file=sys.stderr)
    print(f"{len(list(HTML.rglob('*.html')))} pages in {HTML}")
    return 1 if dead else 0


def guides_first(index: dict[str, Any]) -> dict[str, Any]:
    """Return the index of the search so that words lead to guides: of the API a name is found, but no docstring's words.

    There are more sections of the API than of all else together, and most of them use the words of the field.
    """
    items = [item for item in index["items"] if not item["location"].startswith("api/") or int(item["level"]) <= 2]
    named = [item | {"text": ""} if item["location"].startswith("api/") else item for item in items]
    return index | {"items": sorted(named, key=lambda item: item["location"].startswith("api/"))}


def public() -> tuple[str, ...]:
    """Return the modules that docs/architecture.md calls public."""
    section = (DOCS / "architecture.md").read_text(encoding="utf-8").split("## What is public")[1].split("\n## ")[0]
    return tuple(re.findall(r"^\| `(vedette[.\w]*)` \|", section, re.MULTILINE))


def _lay_out(name: str, page: Path, ran: list[Ran]) -> None:
    """Put a page, and its notebook if it is a tutorial, into the folder that is rendered."""
    text = built.with_tables(page.read_text(encoding="utf-8"), relpath("kinds", Path(name).parent))
    if re.match(r"tutorials/\d", name):
        notebook = PAGES / name.replace(".md", ".ipynb")
        notebook.parent.mkdir(parents=True, exist_ok=True)
        notebook.write_text(json.dumps(notebooks.notebook(text, ran), indent=1), encoding="utf-8")
    pictures = relpath(f"pictures/{pages_folder(page)}", Path(name).parent)
    text = with_outputs(text, ran, pictures)
    text = PICTURE.sub(lambda match: _picture(match, pages_folder(page), pictures), text)
    if re.match(r"tutorials/\d", name):
        text = re.sub(r"^(# .*)$", rf"\1\n\n[As a notebook]({notebook.name})", text, count=1, flags=re.MULTILINE)
    if name == "examples.md":
        text = text.replace("<!-- build: examples -->", _examples())
    if name == "speed.md":
        record = (DOCS / "measured" / "speed.md").read_text(encoding="utf-8")
        text = text.replace("<!-- build: users -->", charts.users(record))
        text = text.replace("<!-- build: speed -->", charts.speed(record, PAGES / "pictures" / "speed" / "times.svg"))
    target = PAGES / name
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(UNSEARCHED + text if name.startswith("measured/") else text, encoding="utf-8")


def _picture(match: re.Match[str], folder: str, pictures: str) -> str:
    """Return the line that shows a picture that a page's blocks have written, if they have been run."""
    file = match["file"].replace("/", "-")
    return f"![{match['title']}]({pictures}/{file})" if (PAGES / "pictures" / folder / file).exists() else ""


def with_outputs(text: str, ran: list[Ran], pictures: str) -> str:
    """Return a page with what each block printed, unless the page states it, and its pictures below it."""
    lines = text.splitlines()
    for one in sorted(ran, key=lambda one: -one.block.end):
        block, below = one.block, []
        indent = re.match(" *", lines[block.line - 2])[0]  # type: ignore[index]
        if one.state == "ran" and block.printed is None and one.printed.strip():
            said = one.printed.strip("\n").splitlines()
            said = [*said[:MOST_LINES], "..."] if len(said) > MOST_LINES else said
            below += ["", '```{ .text .output title="prints" }', *said, "```"]
        for file, title in one.pictures:
            about = re.sub(r"[\[\]]", "", title) or _heading(lines[: block.line])
            below += ["", f"![{about}]({pictures}/{file})"]
        lines[block.end : block.end] = [indent + line if line else line for line in below]
    return "\n".join(lines) + "\n"


def _heading(lines: list[str]) -> str:
    """Return the last heading of these lines."""
    return next((line.lstrip("# ") for line in reversed(lines) if re.match("#+ ", line)), "picture")


def _examples() -> str:
    """Return a list of all examples, and put them into a zip file beside the page."""
    files = sorted(path for path in (ROOT / "examples").rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    with zipfile.ZipFile(PAGES / "examples.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            archive.write(path, path.relative_to(ROOT).as_posix())
    return "\n".join(
        [
            "## All files",
            "",
            *(f"- [{p.relative_to(ROOT / 'examples').as_posix()}](../{p.relative_to(ROOT).as_posix()})" for p in files),
        ]
    )


def _files() -> None:
    """Make links to files of the repository lead to pages that show them."""
    css = ".output { opacity: .85; border-left: 3px solid var(--md-default-fg-color--lightest); }\n"
    css += ".md-typeset td code { word-break: normal; overflow-wrap: normal; }\n"  # names in narrow columns stay whole
    # contrast of 4.5:1 at least, which the theme does not keep
    css += ".md-typeset small, .md-typeset small code { color: var(--md-default-fg-color); opacity: 1; }\n"
    css += ".md-nav__link--active, .md-nav__link--active .md-ellipsis { color: var(--md-default-fg-color) !important; }\n"
    css += "img[src$='.svg'], img[src$='.png'] { background: #fff; max-width: 100%; }\n"
    (PAGES / "site.css").write_text(css, encoding="utf-8")
    wanted: set[str] = set()
    for page in sorted(PAGES.rglob("*.md")):
        name = page.relative_to(PAGES).as_posix()
        text = page.read_text(encoding="utf-8")
        page.write_text(_outside_code(text, lambda part, name=name: _relinked(part, name, wanted)), encoding="utf-8")
    for file in sorted(wanted):
        path, target = ROOT / file, PAGES / "files" / f"{file}.md"
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            listed = "\n".join(f"- `{p.relative_to(path).as_posix()}`" for p in sorted(path.rglob("*.*")) if p.is_file())
            target.write_text(f"{UNSEARCHED}# {file}\n\n{listed}\n", encoding="utf-8")
        else:
            language = {".py": "python", ".toml": "toml"}.get(path.suffix, "text")
            text = path.read_text(encoding="utf-8")
            target.write_text(f"{UNSEARCHED}# {file}\n\n~~~~{language}\n{text}\n~~~~\n", encoding="utf-8")
    for path in DOCS.rglob("*"):
        if path.suffix in PICTURES:
            shutil.copy(path, PAGES / path.relative_to(DOCS))


def _outside_code(text: str, changed) -> str:  # type: ignore[no-untyped-def]
    """Return the text with what lies outside fenced blocks changed."""
    parts = re.split(r"(^ *```.*?^ *``` *$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if i % 2 else changed(part) for i, part in enumerate(parts))


def _anchors(text: str) -> dict[str, str]:
    """Return the anchors of a page's headings, as forges name them, and as the site does."""
    found = {}
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|`", r"\1", heading)
        found[re.sub(r"[^\w\- ]", "", plain.lower()).strip().replace(" ", "-")] = slugify(plain, "-")
    return found


def _relinked(text: str, name: str, wanted: set[str]) -> str:
    """Return the text of a page with links to files of the repository led to pages that show them."""

    def other(match: re.Match[str]) -> str:
        target, _, anchor = match["target"].partition("#")
        if not target or re.match(r"\w+:", target):
            return match[0]
        base = "" if name in ("contributing.md", "changelog.md") else f"docs/{Path(name).parent.as_posix()}/"
        file = normpath(base + target)
        inside = file.removeprefix("docs/") if file.startswith("docs/") else None
        here = inside is not None and ((PAGES / inside).is_file() or Path(inside).suffix in PICTURES)
        if inside is not None and here and inside not in ELSEWHERE:
            target = inside
        elif file in ELSEWHERE:
            target = ELSEWHERE[file]
        elif (ROOT / file).exists():
            wanted.add(file)
            target = f"files/{file}.md"
        else:
            return match[0]
        if anchor and (PAGES / target).is_file():
            anchor = _anchors((PAGES / target).read_text(encoding="utf-8")).get(anchor, anchor)
        before = match["before"]
        if re.fullmatch(r"\[[\w./-]+\.md\]\(", before) and (PAGES / target).is_file():
            before = f"[{navigation.title(PAGES / target).replace('[', '').replace(']', '')}]("
        return f"{before}{relpath(target, Path(name).parent)}{'#' * bool(anchor)}{anchor})"

    return _LINK.sub(other, text)
