"""The site's parts: navigation, pages of kinds, notebooks, links; and the site itself in a browser, where it was built."""

import json
import re
import tomllib

import pytest
import yaml
from docsite import built, links, navigation, notebooks
from docsite.pages import blocks
from docsite.reference import ROLES, examples, page
from docsite.runner import Ran
from docsite.site import guides_first, public, with_outputs

from support.architecture import PUBLIC
from support.paths import DOCS, ROOT
from vedette.cli import _parser
from vedette.config.builder import Builder
from vedette.config.parameters import APART, parameters
from vedette.config.registry import Registry
from vedette.metrics import FIGURES, Judge
from vedette.testing import laws_of

KNOWN = examples()
HAVE_LAWS = ("motion", "sensor", "associator", "estimator", "birth", "lifecycle", "preprocessor", "source", "format")
KINDS = [entry for entry in Registry.installed() if entry.distribution == "vedette" and entry.role in ROLES]


def test_every_page_has_one_place_in_the_navigation():
    committed = navigation.committed()
    nav = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert navigation.misplaced(navigation.expanded(nav, committed, {}), committed) == []


def test_stars_of_shapes_are_shown_and_those_of_a_parameter_are_its_name():
    """`**strategies` was missing in the table of its function's parameters."""
    escaped = pytest.importorskip("docsite.shapes", reason="griffe comes with the site's tools").escaped
    docstring = "Return (*b, n) as `f(*b)`.\n\nParameters\n----------\n**others\n    What (*b) is."
    assert escaped(docstring) == docstring.replace("(*b, n)", r"(\*b, n)").replace("(*b) is", r"(\*b) is")


def test_pages_stay_short():
    """What a user reads: 2,500 words a page at most, and 60,000 in all."""
    pages = {name: page for name, page in navigation.committed().items() if name not in ("changelog.md", "contributing.md")}
    words = {name: len(page.read_text(encoding="utf-8").split()) for name, page in pages.items()}
    assert {name: count for name, count in words.items() if count > 2_500} == {}
    assert sum(words.values()) <= 60_000


def test_a_page_without_a_place_a_place_without_a_page_and_two_places_are_told(tmp_path):
    (tmp_path / "a.md").write_text("# A\n", encoding="utf-8")
    pages = {"a.md": tmp_path / "a.md", "b.md": tmp_path / "a.md", "c/d.md": tmp_path / "a.md"}
    nav = [{"Home": "a.md"}, {"More": ["gone.md", "a.md", "c/*.md"]}]
    assert navigation.misplaced(navigation.expanded(nav, pages, {}), pages) == [
        "b.md: has no place in the navigation of mkdocs.yml",
        "gone.md: mkdocs.yml names it, and there is no such page",
        "a.md: stands in mkdocs.yml twice",
    ]


def test_the_api_has_the_public_modules():
    assert sorted(public()) == sorted(PUBLIC)


@pytest.mark.parametrize("kind", ["coarse", "k_best"])
def test_a_reference_over_two_lines_and_two_of_one_kind_stand_together(kind):
    (entry,) = [entry for entry in KINDS if entry.kind == kind]
    before, reference = page(entry, None).split("## Reference")
    assert re.search(r"[.:]\n*\Z", before)
    assert reference.strip().startswith(("Koch", "Garcia-Fernandez"))


@pytest.mark.parametrize("entry", KINDS, ids=lambda entry: f"{entry.role}-{entry.kind}")
def test_the_page_of_a_kind_has_its_parameters_with_units_and_its_source(entry):
    text = page(entry, KNOWN.get((entry.role, entry.kind)))
    assert text.startswith(f"# {entry.kind}\n")
    for parameter in entry.parameters:
        assert f"| `{parameter.name}` |" in text
    assert "\\n" not in text
    assert entry.cls.__module__ in text


def test_kinds_of_the_shelf_have_formula_reference_example_and_laws():
    shelf = [entry for entry in KINDS if entry.cls.__module__.startswith("vedette_standard.")]
    for entry in shelf:
        text = page(entry, KNOWN.get((entry.role, entry.kind)))
        assert f'kind = "{entry.kind}"' in text, entry.kind
        assert text.count("\n- `") >= 5, entry.kind
    assert sum("## Reference" in page(entry, None) for entry in shelf) > 0.9 * len(shelf)


@pytest.mark.parametrize("entry", KINDS, ids=lambda entry: f"{entry.role}-{entry.kind}")
def test_every_kind_has_an_example_that_builds_it(entry):
    if entry.role == "reproduction":
        assert f"vedette reproduce {entry.kind.replace('_', '-')}" in page(entry, None)
        return
    if entry.role in APART:
        assert entry.summary in page(entry, None)
        return
    line, file = KNOWN[entry.role, entry.kind]
    assert f"{entry.role} = {line}" in page(entry, (line, file))
    given = tomllib.loads(f"it = {line}")["it"]
    assert given.pop("kind") == entry.kind
    builder = Builder(Registry.installed())
    built = builder.construct(entry.cls, entry.parameters, given, "", set())
    assert not builder.problems
    assert isinstance(built, entry.cls)


def reference(name):
    return built.with_tables((DOCS / "reference" / f"{name}.md").read_text(encoding="utf-8"), "../kinds")


def test_the_references_have_every_command_figure_and_law():
    commands, figures, laws = map(reference, ("commands", "figures", "laws"))
    parser = _parser()
    for name, below in parser.below.items():
        assert f"## vedette {name}\n" in commands
        assert all(f"`{option}" in commands for option in below._option_string_actions if option not in ("-h", "--help"))
    assert all(f"| `{figure.name}` | {figure.unit} |" in figures for figure in FIGURES)
    assert all(f"| `{parameter.name}` |" in figures for parameter in parameters(Judge))
    assert all(f"| `{law.name}` | " in laws for entry in KINDS if entry.role in HAVE_LAWS for law in laws_of(entry.cls))
    assert "<!-- build" not in commands + figures + laws


def test_a_table_of_kinds_leads_to_their_pages():
    own = [entry for entry in KINDS if entry.cls.__module__.startswith("vedette_flir.")]
    text = built.with_tables("<!-- build: kinds vedette_flir -->")
    assert all(f"[`{entry.kind}`](kinds/{entry.role}/{entry.kind}.md)" in text for entry in own)
    assert text.count("](kinds/") == len(own)


def test_the_search_finds_names_of_the_api_and_words_of_guides():
    places = [("api/vedette.html", 1), ("api/vedette.html#vedette.Gate", 2), ("api/vedette.html#vedette.Gate.limit", 3)]
    items = [{"location": place, "level": level, "title": place[-4:], "text": "gate"} for place, level in places]
    guide = {"location": "components.html#gate", "level": 2, "title": "Gates", "text": "gate"}
    found = guides_first({"config": {}, "items": [*items, guide]})["items"]
    assert found == [guide, *(item | {"text": ""} for item in items[:2])]


TEXT = """# Page

```python
print(1)
```

```text
1
```

`own.csv`:

```csv
a,b
```

```python
plot()
```

The end.
"""


def test_outputs_and_pictures_stand_below_their_blocks():
    first, _, saved, last = blocks(TEXT)
    ran = [Ran(first, "ran", "1\n"), Ran(saved, "saved"), Ran(last, "ran", "more\n", (("3a.svg", "Up"),))]
    text = with_outputs(TEXT, ran, "pictures/page")
    assert text.count("print") == TEXT.count("print") + 1  # what the page states is not shown twice
    assert re.search(r"plot\(\)\n```\n\n```\{ \.text .*\}\nmore\n```\n\n!\[Up\]\(pictures/page/3a\.svg\)\n", text)


def test_a_notebook_has_a_cell_a_block_and_what_was_printed():
    first, _, saved, last = blocks(TEXT)
    made = notebooks.notebook(TEXT, [Ran(first, "ran", "1\n"), Ran(saved, "saved"), Ran(last, "ran")])
    assert [cell["cell_type"] for cell in made["cells"]] == ["markdown", "code", "markdown", "code", "code", "markdown"]
    assert made["cells"][1]["outputs"][0]["text"] == "1\n"
    assert made["cells"][3]["source"] == "%%writefile own.csv\na,b"
    assert json.loads(json.dumps(made)) == made


def test_dead_links_are_found(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "index.html").write_text('<h1 id="top"><a href="sub/a.html#b">1</a><a href="#top">2</a><img src="no.png">')
    (tmp_path / "sub" / "a.html").write_text(
        '<a href="../index.html#gone">1</a><a href="https://x">2</a><a href="https://a.org/b">3</a><a href="..">4</a>'
    )
    assert links.dead(tmp_path) == [
        "index.html: no.png: leads nowhere",
        "index.html: sub/a.html#b: the page has no such anchor",
        "sub/a.html: ../index.html#gone: the page has no such anchor",
        "sub/a.html: https://x: is no address",
    ]
