"""Check the links of rendered pages: every page, picture, script and anchor that they name is there."""

import re
from html import unescape
from os.path import normpath
from pathlib import Path
from urllib.parse import unquote, urlsplit

_SCRIPT = re.compile(r"(<(script|style)\b[^>]*>).*?</\2>|<!--.*?-->", re.DOTALL)
_TAG = re.compile(r"<(?!base\b)\w+(?:\s+[^\s=>]+(?:\s*=\s*(?:\"[^\"]*\"|'[^']*'|[^\s>]+))?)+")
_GIVEN = re.compile(r"\s(id|name|href|src)=(?:\"([^\"]*)\"|'([^']*)'|([^\s\"'>]+))")


def _named(text: str) -> tuple[set[str], set[str]]:
    """Return what a page names, and the anchors that it has; a parser takes five times as long for hundreds of pages."""
    names, anchors = set(), set()
    for tag in _TAG.findall(_SCRIPT.sub(r"\1", text)):
        for name, *values in _GIVEN.findall(tag):
            (names if name in ("href", "src") else anchors).add(unescape("".join(values)))
    return names - {""}, anchors


def dead(folder: Path) -> list[str]:
    """Return a line for each link that leads nowhere, or is no address."""
    pages = {path: _named(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html")}
    files = {str(path) for path in folder.rglob("*") if path.is_file()}
    anchors = {str(path): its for path, (_, its) in pages.items()}
    wrong = []
    for path, (names, _) in pages.items():
        for name in names:
            reason = _why(str(path), name, str(folder), files, anchors)
            if reason:
                wrong.append(f"{path.relative_to(folder)}: {name}: {reason}")
    return sorted(wrong)


def _why(path: str, name: str, folder: str, files: set[str], anchors: dict[str, set[str]]) -> str | None:
    """Return why a link is dead; of links to other sites only the form is judged."""
    address = urlsplit(name)
    if address.scheme in ("http", "https"):
        return None if "." in address.netloc else "is no address"
    if address.scheme:
        return None if address.scheme in ("mailto", "data", "javascript") else "is of an unknown scheme"
    target = path
    if address.path:
        inside = address.path.startswith("/")
        target = normpath(f"{folder if inside else path.rpartition('/')[0]}/{unquote(address.path).lstrip('/')}")
    target = target if target in files else f"{target}/index.html"
    if target not in files:
        return "leads nowhere"
    anchor = unquote(address.fragment)
    if anchor and target in anchors and anchor not in anchors[target] and not anchor.startswith("__"):
        return "the page has no such anchor"
    return None
