"""Every code block of the documentation does what its page says, pasted in order into an empty folder."""

import re

import pytest
from docsite import cache
from docsite.cache import outputs
from docsite.pages import RUN, agrees, blocks, pages
from docsite.runner import faults, run

ALL = {page: blocks(page.read_text(encoding="utf-8")) for page in pages()}


@pytest.fixture(scope="module")
def ran(request):
    """What became of all blocks of the profile's pace; kept where the site was built from the same sources."""
    return outputs(pages(), "nightly" if request.config.option.vedette_profile == "nightly" else "fast")


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_its_blocks_do_what_it_says(ran, page):
    assert faults(page, ran[page]) == []


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.stem, marks=pytest.mark.costly(page))
        for page, its in ALL.items()
        if any(block.pace == "slow" and block.runs for block in its)
    ],
)
def test_its_slow_blocks_do_what_it_says(page):
    assert faults(page, outputs([page], "slow")[page]) == []


def test_fewer_than_one_block_in_twenty_cannot_be_run():
    code = [block for of_page in ALL.values() for block in of_page if block.code_of_readers]
    cannot = [block for block in code if block.reason is not None]
    assert len(code) > 60
    assert len(cannot) < 0.05 * len(code), [block.reason for block in cannot]


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_slow_blocks_state_no_error(page):
    """The default tests pass slow blocks by, and one that stated the error of an unfinished page would stay so."""
    stated = [block.printed or "" for block in ALL[page] if block.pace != "fast" and block.runs]
    assert [text for text in stated if re.search(r"^\w+(Error|Refused): ", text, re.MULTILINE)] == []


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_commands_stand_in_blocks_that_are_run(page):
    """Four spaces before a line make code, too, which nobody runs: they are for formulas."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert re.findall(r"^ {4,}(?:vedette|python3?|pip|nox|dask|import|from) .*", text, re.MULTILINE) == []


def test_no_block_installs_into_the_environment_of_the_tests(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```sh\npip install vedette\n```\n", encoding="utf-8")
    (fault,) = faults(page, run([page])[page])
    assert "line 2: ValueError: installs packages" in fault


def test_a_page_that_uses_the_examples_says_where_they_are():
    for page, of_page in ALL.items():
        used = any("examples/" in block.code and block.language in RUN for block in of_page)
        assert not used or "examples.md)" in page.read_text(encoding="utf-8"), page


PAGE = """# A page

`own.toml`:

```toml
estimator = { kind = "kalman", motion = { kind = "constant_velocity", sigma_accel = 0.5 } }
sensors.radar = { kind = "cartesian_position", sigma = 10.0 }
associator = { kind = "pda" }
lifecycle = { kind = "m_of_n" }
birth = { kind = "from_returns", spread = { vx = 10, vy = 10 } }
```

<!-- into: own.toml -->
```toml
associator = { kind = "MISSING" }
```

```python
x = 1
x + 1
```

```text
2
```

```sh
here=out && mkdir $here && cd $here
```

```sh
echo $here in $(basename $PWD) ; echo 17 things
```

```text
out in out
... things
```

*Not run here: the sun must shine.*

```sh
false
```

<!-- nightly -->
```sh
exit 3
```

```python
import matplotlib.pyplot as plt

plt.plot([1, 2])
plt.title("Up")
```

```python
{}["left"]
```

```text
KeyError: 'left'
```

```python
x + y
```

```python
"after a fault nothing is run"
```
"""


DRAWN = """```python
41
```

<!-- slow -->
```python
import matplotlib.pyplot as plt

plt.plot([1, 2])
```

<!-- nightly -->
```python
43
```
"""


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "page.md"
    path.write_text(PAGE, encoding="utf-8")
    return path


@pytest.mark.costly
def test_what_becomes_of_blocks_of_each_kind(page, tmp_path):
    told = run([page], pictures=tmp_path / "pictures")[page]
    assert [one.state for one in told] == ["saved", "tried"] + ["not reached"] * 3 + [
        "not run",
        "nightly",
        *(["not reached"] * 4),
    ]
    (fault,) = faults(page, told)
    assert "line 15" in fault
    assert "associator.kind: unknown kind 'MISSING'" in fault
    page.write_text(PAGE.replace("MISSING", "gnn"), encoding="utf-8")
    told = run([page], pictures=tmp_path / "pictures")[page]
    picture = (tmp_path / "pictures" / f"{tmp_path.name}-page" / told[7].pictures[0][0]).read_text()
    assert [one.state for one in told] == [
        *("saved", "tried", "ran", "ran", "ran", "not run", "nightly"),
        *("ran", "ran", "ran", "not reached"),
    ]
    assert told[7].pictures[0][1] == "Up"
    assert picture.startswith("<?xml")
    (fault,) = faults(page, told)
    assert "NameError: name 'y' is not defined" in fault


@pytest.mark.parametrize(("mark", "paces"), [("slow", ["slow", "nightly"]), ("nightly", ["nightly"])])
def test_slow_blocks_are_run_when_the_site_is_built_or_by_night(tmp_path, mark, paces):
    page = tmp_path / "page.md"
    for text in ("<!-- {} -->\n```sh\nexit 3\n```\n", "<!-- {} -->\n\n# A page\n\n```sh\nexit 3\n```\n"):
        page.write_text(text.format(mark), encoding="utf-8")
        for pace in ("fast", "slow", "nightly"):
            (one,) = run([page], pace=pace)[page]
            assert (one.state, one.fault) == (("ran", "exit code 3\n") if pace in paces else (mark, None))


@pytest.mark.costly
def test_what_ran_once_is_kept_with_its_pictures_and_serves_a_faster_pace(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "KEPT", tmp_path / "kept")
    page, here = tmp_path / "page.md", f"{tmp_path.name}-page"
    page.write_text(DRAWN, encoding="utf-8")
    first = outputs([page], "slow", tmp_path / "first")[page]
    assert [one.state for one in first] == ["ran", "ran", "nightly"]
    monkeypatch.setattr(cache, "run", lambda pages, *_: dict(zip(pages, (), strict=True)))  # nothing is left to run
    for pace in ("slow", "fast"):
        assert outputs([page], pace, tmp_path / pace)[page] == first
        assert (tmp_path / pace / here / "1a.svg").read_bytes() == (tmp_path / "first" / here / "1a.svg").read_bytes()
    with pytest.raises(ValueError, match="shorter"):
        outputs([page], "nightly")
    page.write_text(DRAWN.replace("41", "42"), encoding="utf-8")
    with pytest.raises(ValueError, match="shorter"):
        outputs([page], "slow")


def test_a_fault_is_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "KEPT", tmp_path / "kept")
    page = tmp_path / "page.md"
    page.write_text("```python\nx\n```\n", encoding="utf-8")
    assert [len(faults(page, outputs([page], "fast")[page])) for _ in range(2)] == [1, 1]


@pytest.mark.parametrize(
    ("stated", "printed", "same"),
    [
        ("a\nb\n", "a\nb\n", True),
        ("a\nb\n", "a\nc\n", False),
        ("a\n...\n", "a\nb\nc\n", True),
        ("a\n...\nd\n", "a\nd\n", True),
        ("a ... c\n", "a b c\n", True),
        ("a ... c\n", "a\nc\n", False),
        ("a\n", "a\nb\n", False),
        ("1.5\n", "1x5\n", False),
    ],
)
def test_a_page_states_what_is_printed(stated, printed, same):
    assert agrees(stated, printed) == same


def test_a_fence_that_nobody_understands_is_refused():
    with pytest.raises(ValueError, match="line 1: blocks are"):
        blocks("```perl\n1\n```\n")
    with pytest.raises(ValueError, match="line 2: the block is not"):
        blocks("\n```python\n1\n")
    with pytest.raises(ValueError, match="line 1: a fence is"):
        blocks("```python numbers\n1\n```\n")
