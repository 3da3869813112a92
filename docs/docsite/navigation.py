"""The site's navigation: what `mkdocs.yml` says, with names that have a * replaced by pages. No page may lack a place."""

from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from docsite.pages import DOCS

UNTITLED = ("kinds/", "api/")  # written by the build
DEVELOPERS = (
    "adr/",
    "measured/",
    "architecture.md",
    "releasing.md",
)  # of those who work on Vedette itself: in the repository alone


def title(page: Path) -> str:
    """Return the heading of a page."""
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("# "):
            return line.removeprefix("# ").strip()
    raise ValueError(f"{page}: has no heading: a line that begins with `# `")


def expanded(nav: list[Any], pages: dict[str, Path], written: dict[str, list[Any]]) -> list[Any]:
    """Return the navigation with every * and every written part replaced by pages; `pages` has them by their names."""
    full: list[Any] = []
    for entry in nav:
        ((name, value),) = entry.items() if isinstance(entry, dict) else [("", entry)]
        if isinstance(value, list):
            full.append({name: expanded(value, pages, written)})
        elif value in UNTITLED:
            full.append({name: written.get(value, [])})
        elif "*" in value:
            several = [{title(pages[page]): page} for page in sorted(pages) if fnmatch(page, value)]
            full += [{name: several}] if name else several
        else:
            full.append(entry)
    return full


def named(nav: list[Any]) -> list[str]:
    """Return the pages of a navigation, in order."""
    found: list[str] = []
    for entry in nav:
        value = next(iter(entry.values())) if isinstance(entry, dict) else entry
        found += named(value) if isinstance(value, list) else [value]
    return found


def misplaced(nav: list[Any], pages: dict[str, Path]) -> list[str]:
    """Return what is wrong between a navigation, expanded, and the pages that there are."""
    placed = named(nav)
    lacking = [f"{page}: has no place in the navigation of mkdocs.yml" for page in sorted(pages) if page not in placed]
    unknown = [f"{page}: mkdocs.yml names it, and there is no such page" for page in placed if page not in pages]
    return (
        lacking + unknown + [f"{page}: stands in mkdocs.yml twice" for page in sorted(set(placed)) if placed.count(page) > 1]
    )


def committed() -> dict[str, Path]:
    """Return the pages of the site that are written by hand, by the names that it gives them."""
    found = {path.relative_to(DOCS).as_posix(): path for path in DOCS.rglob("*.md")}
    found = {name: path for name, path in found.items() if not name.startswith(DEVELOPERS)}
    return found | {"contributing.md": DOCS.parent / "CONTRIBUTING.md", "changelog.md": DOCS.parent / "CHANGELOG.md"}


def measured() -> dict[str, Path]:
    """Return the records of measurements: pages to which others lead, in no navigation and not searched."""
    return {path.relative_to(DOCS).as_posix(): path for path in (DOCS / "measured").glob("*.md")}
