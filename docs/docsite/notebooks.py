"""Turn a page into a Jupyter notebook, with what its blocks print, and execute one as a reader would."""

import re
from pathlib import Path
from typing import Any

from docsite.pages import blocks
from docsite.runner import Ran, environment, laid_out


def notebook(text: str, ran: list[Ran]) -> dict[str, Any]:
    """Return the notebook (nbformat 4.5) of a page: prose as Markdown, blocks that run as cells."""
    by_line = {one.block.line: one for one in ran}
    lines, cells, at = text.splitlines(), [], 0
    skip = None
    for block in blocks(text):
        above = "\n".join(lines[at : block.line - 2])
        cells += _prose(above)
        at = block.end
        fence = "\n".join(lines[block.line - 2 : block.end])
        if skip is not None and skip == block.code and block.language == "text":
            skip = None
        elif block.title is not None:
            cells.append(_code(f"%%writefile {block.title}\n{block.code}", None))
        elif block.runs and block.reason is None:
            source = block.code if block.language == "python" else f"%%bash\n{block.code}"
            cells.append(_code(source, by_line.get(block.line)))
            skip = block.printed
        else:
            cells += _prose(fence)
    cells += _prose("\n".join(lines[at:]))
    for i, cell in enumerate(cells):
        cell["id"] = f"cell{i}"
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def _prose(text: str) -> list[dict[str, Any]]:
    text = re.sub(r"^ *<!-- .* -->$", "", text, flags=re.MULTILINE).strip()
    return [{"cell_type": "markdown", "metadata": {}, "source": text}] if text else []


def _code(source: str, ran: Ran | None) -> dict[str, Any]:
    outputs = []
    if ran is not None and ran.printed:
        outputs.append({"output_type": "stream", "name": "stdout", "text": ran.printed})
    return {"cell_type": "code", "metadata": {}, "execution_count": None, "source": source.rstrip("\n"), "outputs": outputs}


def executed(made: dict[str, Any], folder: Path) -> Any:
    """Run all cells of a notebook in an empty folder; return it with their outputs. CellExecutionError names one that fails.

    The examples are there if a cell names them. It needs nbclient and ipykernel.
    """
    import nbformat
    from nbclient import NotebookClient

    desk = laid_out(folder, (cell["source"] for cell in made["cells"] if cell["cell_type"] == "code"))
    own = {name: str(folder / name) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")}
    notebook = nbformat.from_dict(made)
    nbformat.validate(notebook)
    client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": desk}})
    readers = {name: value for name, value in environment().items() if name != "MPLBACKEND"} | own
    return client.execute(env=readers)
