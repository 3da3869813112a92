"""Which tests hold sentences of errors: `PYTHONPATH=tests python -m support.sentences` lists them.

A test holds the place of an error, its kind and the number that matters; its author may better the words. A sentence is a
text of six words or more that `match=` asks for, or that a text of errors is compared with.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from attrs import frozen

from support.paths import ROOT

LEAST = 6
"""Words of a sentence."""

_OF_ERRORS = re.compile(
    r"str\(\w*(error|caught|failure|refus|problem|told|excinfo|info|raised|fault|wrong)\w*(\.value)?\)"
    r"|\.value\)|\.err\b|\bstderr\b|\berr\b|problems|\.refused|\.text\b.*problem"
)


@frozen
class Text:
    """A text of an error that a test asks for."""

    file: str
    line: int
    text: str

    @property
    def sentence(self) -> bool:
        """Whether it holds a sentence; the place that it begins with and names in quotes are no words of it."""
        words = re.sub(r"^\S+: |\\[a-zA-Z]|'[^' ]*'|`[^` ]*`", " ", self.text)
        return len(re.findall(r"\b[a-zA-Z]{2,}\b", words)) >= LEAST


def texts(source: str, file: str = "") -> Iterator[Text]:
    """Yield the texts of errors that the tests of a file ask for, those among their parameters included."""
    if "match=" not in source and not _OF_ERRORS.search(source):
        return
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef):
            columns = dict(_parameters(function))
            for asked in _asked(function):
                for node in columns.get(asked.id, ()) if isinstance(asked, ast.Name) else (asked,):
                    for literal in _literals(node):
                        yield Text(file, literal.lineno, literal.value)


def _asked(function: ast.FunctionDef) -> Iterator[ast.expr]:
    """Yield what a function's statements compare with the text of an error."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call):
            yield from (keyword.value for keyword in node.keywords if keyword.arg == "match")
            ends = isinstance(node.func, ast.Attribute) and node.func.attr in ("startswith", "endswith")
            if ends and _OF_ERRORS.search(ast.unparse(node.func)):
                yield from node.args
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            if any(_OF_ERRORS.search(ast.unparse(side)) for side in sides):
                yield from (side for side in sides if not _OF_ERRORS.search(ast.unparse(side)))


def _parameters(function: ast.FunctionDef) -> Iterator[tuple[str, list[ast.expr]]]:
    """Yield the name of each parameter of a parametrized test, and what is given for it."""
    for mark in function.decorator_list:
        if not (isinstance(mark, ast.Call) and ast.unparse(mark.func).endswith("parametrize") and len(mark.args) > 1):
            continue
        given, rows = mark.args[:2]
        names = [x.value for x in ast.walk(given) if isinstance(x, ast.Constant) and isinstance(x.value, str)]
        names = [name.strip() for one in names for name in one.split(",")]
        if isinstance(rows, ast.List | ast.Tuple):
            cells = [getattr(row, "elts", None) or getattr(row, "args", None) or [row] for row in rows.elts]
            for i, name in enumerate(names):
                yield name, [row[i] for row in cells if len(row) > i] if len(names) > 1 else list(rows.elts)


def _literals(node: ast.expr) -> Iterator[ast.Constant]:
    """Yield the texts in an expression; those of an f-string one by one."""
    yield from (x for x in ast.walk(node) if isinstance(x, ast.Constant) and isinstance(x.value, str) and x.value)


def all_texts() -> list[Text]:
    """Return the texts of errors that all tests ask for."""
    files = sorted((ROOT / "tests").rglob("*.py"))
    return [text for path in files for text in texts(path.read_text(encoding="utf-8"), str(path.relative_to(ROOT)))]


def main() -> None:
    """Print each sentence with its place, and how many there are."""
    found = all_texts()
    sentences = [text for text in found if text.sentence]
    for text in sentences:
        print(f"{text.file}:{text.line}: {text.text!r}")
    files = sorted({text.file for text in sentences}, key=lambda file: -sum(text.file == file for text in sentences))
    for file in files:
        print(f"{sum(text.file == file for text in sentences):4} {Path(file)}")
    print(f"{len(sentences)} sentences among {len(found)} texts of errors: {len(sentences) / len(found):.0%}")


if __name__ == "__main__":
    main()
