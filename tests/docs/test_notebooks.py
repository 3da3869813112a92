"""Each tutorial as a notebook: valid, and executed by a Jupyter kernel from an empty folder, cell by cell."""

import re
from importlib.util import find_spec

import pytest
from docsite.notebooks import executed, notebook
from docsite.pages import DOCS, agrees, blocks

TUTORIALS = sorted((DOCS / "tutorials").glob("[0-9]*.md"))
QUICK = ("01-first-tracker", "05-manoeuvres")
LACKING = [name for name in ("nbformat", "nbclient", "ipykernel") if find_spec(name) is None]
pytestmark = pytest.mark.skipif(bool(LACKING), reason=f"needs {', '.join(LACKING)}: the extra `site` brings them")


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_it_is_a_valid_notebook_that_holds_the_whole_page(page):
    import nbformat

    text = page.read_text(encoding="utf-8")
    made = notebook(text, [])
    nbformat.validate(nbformat.from_dict(made))
    assert nbformat.reads(nbformat.writes(nbformat.from_dict(made)), as_version=4) == nbformat.from_dict(made)
    all_cells = "\n".join(cell["source"] for cell in made["cells"])
    lost = [block.line for block in blocks(text) if block.language != "text" and block.code.strip() not in all_cells]
    assert lost == []


def printed(cell):
    """What a cell printed; None if it shows more than text."""
    if any(output["output_type"] != "stream" for output in cell["outputs"]):
        return None
    return "".join(output["text"] for output in cell["outputs"] if output["name"] == "stdout")


SLOW = pytest.mark.nightly("up to 25 s each")


@pytest.mark.costly
@pytest.mark.parametrize(
    "page", [pytest.param(page, id=page.stem, marks=() if page.stem in QUICK else SLOW) for page in TUTORIALS]
)
def test_it_runs_from_an_empty_folder_and_prints_what_the_page_says(page, tmp_path):
    text = page.read_text(encoding="utf-8")
    done = executed(notebook(text, []), tmp_path)
    cells = [cell for cell in done["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, 1 + len(cells)))
    stated = {re.sub(r"\s+", "", block.code): block.printed for block in blocks(text) if block.printed is not None}
    compared = 0
    for cell in cells:
        says = stated.get(re.sub(r"\s+", "", cell["source"].removeprefix("%%bash\n")))
        if says is not None and (gave := printed(cell)) is not None:
            assert agrees(says, gave), f"the page says\n{says}\nbut the notebook prints\n{gave}"
            compared += 1
    assert compared


@pytest.mark.costly
def test_examples_are_there_if_they_are_named_and_a_cell_that_fails_is_told(tmp_path):
    from nbclient.exceptions import CellExecutionError

    page = "# A page\n\n```sh\nls examples/harbour.toml\n```\n\n```python\n1 / 0\n```\n"
    with pytest.raises(CellExecutionError, match="ZeroDivisionError"):
        executed(notebook(page, []), tmp_path)
