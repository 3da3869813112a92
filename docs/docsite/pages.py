"""Find the code blocks of a page of the documentation, and what the page says about each.

A page is Markdown, and its blocks run in order in an empty folder, as a reader would paste them:

- ```python and ```sh blocks are run; a ```text block right after one is what it prints, with `...` for what may differ;
- a block under a line "`name`:", or with title="name", is a file, which is saved under that name;
- other ```toml blocks are parts of a config: `<!-- into: tracker.toml -->` above one names the file that it is tried in;
- other ```json blocks are read, line by line;
- `<!-- slow -->` above a block: run where its page or what that imports has changed, in a share of the other runs, and by
  night; `<!-- nightly -->`: by night alone. As a page's first line, either is for all its blocks;
- `<!-- needs: stonesoup -->` above a block: it is passed by where that package is not installed;
- `<!-- picture: out/run/picture.png Its title -->` stands for a picture that the blocks have written by the end of the page;
- a line `*Not run here: reason.*` above a block: nobody but the reader can run it. Readers see the mark, so it must be true;
- `<!-- run by .ci/run -->` above a block: something else than this runner runs it.
"""

import re
from pathlib import Path

from attrs import evolve, frozen

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PICTURE = re.compile(r"^<!-- picture: (?P<file>\S+) (?P<title>.+) -->$", re.MULTILINE)
PACES = ("fast", "slow", "nightly")
"""The tests run the fast blocks, the slow ones as costly tests, and all by night; so does a whole build of the site."""
RUN, DATA, PLAIN = ("python", "sh"), ("toml", "yaml", "json", "csv"), ("text", "")
_FENCE = re.compile(r'^(?P<indent> *)(?P<ticks>```+)(?P<language>\w*)(?: +title="(?P<title>[^"]+)")? *$')
_COMMENT = re.compile(r"^ *<!-- (?P<what>(?P<pace>slow|nightly)|into: (?P<into>\S+)|needs: (?P<needs>\w+)) -->$")
_MARK = re.compile(r"^ *(?:\*Not run here: (?P<reason>.+)\.\*|<!-- run by (?P<other>.+) -->)$")
_NAMED = re.compile(r"^ *`(?P<title>[\w./-]+\.\w+)`:$")
_PASSED_OVER = re.compile(r"^ *(\*Not run here: .*|<!-- .* -->|`[\w./-]+`:)?$")


@frozen
class Block:
    """A fenced block: its language, its code, the line of the page where the code begins, and what the page says of it."""

    language: str
    code: str
    line: int
    title: str | None = None
    reason: str | None = None
    into: str | None = None
    needs: str | None = None
    pace: str = "fast"
    printed: str | None = None
    end: int = 0

    @property
    def code_of_readers(self) -> bool:
        """Tell whether it is something to run, to save or to paste, not a picture in letters."""
        return self.title is not None or self.language in (*RUN, *DATA)

    @property
    def runs(self) -> bool:
        """Tell whether it is run, rather than saved or looked at."""
        return self.language in RUN and self.title is None

    @property
    def needs_recordings(self) -> bool:
        """Tell whether it needs the recordings in the folder that VEDETTE_DATA names."""
        return "VEDETTE_DATA" in self.code


def pages() -> list[Path]:
    """Return the pages whose blocks are run: the README and all of the documentation but the record of decisions."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(p for p in DOCS.rglob("*.md") if p.parent.name != "adr")]


def blocks(text: str) -> list[Block]:
    """Return the blocks of a page; ValueError, with the line, if one is not closed or of a language that nobody runs."""
    lines, found, i = text.splitlines(), [], 0
    first_line = _COMMENT.match(lines[0]) if lines else None
    pace = (first_line and first_line["pace"]) or "fast"
    while i < len(lines):
        fence = _FENCE.match(lines[i])
        if fence is None:
            if lines[i].lstrip().startswith("```"):
                raise ValueError(f'line {i + 1}: a fence is ```language or ```language title="name", got {lines[i].strip()}')
            i += 1
            continue
        first = i + 1
        end = first
        while end < len(lines) and lines[end].strip() != fence["ticks"]:
            end += 1
        if end == len(lines):
            raise ValueError(f"line {i + 1}: the block is not closed")
        if fence["language"] not in (*RUN, *DATA, *PLAIN) and fence["title"] is None:
            raise ValueError(f"line {i + 1}: blocks are {', '.join((*RUN, *DATA))} or text, got {fence['language']}")
        width = len(fence["indent"])
        code = "\n".join(line[width:] if not line[:width].strip() else line for line in lines[first:end]) + "\n"
        block = Block(fence["language"], code, first + 1, fence["title"], pace=pace, end=end + 1)
        found.append(_marked(block, lines[:i]))
        i = end + 1
    return _with_what_they_print(found, lines)


def _marked(block: Block, above: list[str]) -> Block:
    """Return the block with what the lines right above it say."""
    for line in reversed(above):
        if not _PASSED_OVER.match(line):
            break
        if mark := _MARK.match(line):
            block = evolve(block, reason=mark["reason"] or f"run by {mark['other']}")
        elif (named := _NAMED.match(line)) and block.title is None:
            block = evolve(block, title=named["title"])
        elif comment := _COMMENT.match(line):
            (told,) = ({name: said} for name, said in comment.groupdict().items() if said and name != "what")
            block = evolve(block, **told)
    return block


def _with_what_they_print(found: list[Block], lines: list[str]) -> list[Block]:
    """Return the blocks with, for each that is run, the text block that follows it with nothing but empty lines between."""
    told = []
    for i, block in enumerate(found):
        following = found[i + 1] if i + 1 < len(found) else None
        if block.runs and following and following.language == "text" and following.title is None:
            between = lines[block.end : following.line - 2]
            if not any(line.strip() for line in between):
                block = evolve(block, printed=following.code)
        told.append(block)
    return told


def agrees(stated: str, printed: str) -> bool:
    """Tell whether a page states what was printed; a line of `...` is any lines, `...` within a line any text."""
    pattern = []
    for line in stated.strip("\n").splitlines():
        if line.strip() == "...":
            pattern.append(r"(?:.*\n)*?")
        else:
            pattern.append(r".*?".join(re.escape(part) for part in line.rstrip().split("...")) + r"\n")
    lines = "".join(f"{line.rstrip()}\n" for line in printed.strip("\n").splitlines())
    return re.fullmatch("".join(pattern), lines) is not None
