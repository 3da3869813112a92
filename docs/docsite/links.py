"""Check the links of rendered pages: every page, picture, script and anchor that they name is there."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class _Page(HTMLParser):
    """What a page names, and the anchors that it has."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take links, pictures, scripts and anchors."""
        given = dict(attrs)
        self.anchors |= {value for name in ("id", "name") if (value := given.get(name))}
        self.names += [value for name in ("href", "src") if (value := given.get(name)) and tag != "base"]


def dead(folder: Path) -> list[str]:
    """Return a line for each link that leads nowhere, or is no address."""
    pages = {}
    for path in sorted(folder.rglob("*.html")):
        pages[path] = page = _Page()
        page.feed(path.read_text(encoding="utf-8"))
    wrong = []
    for path, page in pages.items():
        for name in page.names:
            reason = _why(path, name, folder, pages)
            if reason:
                wrong.append(f"{path.relative_to(folder)}: {name}: {reason}")
    return sorted(set(wrong))


def _why(path: Path, name: str, folder: Path, pages: dict[Path, _Page]) -> str | None:
    """Return why a link is dead; of links to other sites only the form is judged."""
    address = urlsplit(name)
    if address.scheme in ("http", "https"):
        return None if "." in address.netloc else "is no address"
    if address.scheme:
        return None if address.scheme in ("mailto", "data", "javascript") else "is of an unknown scheme"
    target = path if not address.path else (path.parent / unquote(address.path)).resolve()
    if address.path.startswith("/"):
        target = folder / unquote(address.path).lstrip("/")
    target = target / "index.html" if target.is_dir() else target
    if not target.exists():
        return "leads nowhere"
    anchor = unquote(address.fragment)
    if anchor and target in pages and anchor not in pages[target].anchors and not anchor.startswith("__"):
        return "the page has no such anchor"
    return None
