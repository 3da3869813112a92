"""Wrong files are refused by their path."""

import os
import tracemalloc
from functools import partial
from pathlib import Path

import pytest

from support.cpu import seconds
from vedette import ConfigError, Registry
from vedette.config import load
from vedette.config.files import read_file

FILES: list[tuple[str, bytes, str]] = [
    ("empty.toml", b"", "the file is empty"),
    ("blank.json", b" \n\n", "the file is empty"),
    ("empty.yaml", b"", "the file is empty"),
    ("comment.yaml", b"# nothing\n", "must hold a table of names, got NoneType"),
    ("cut.toml", b'[estimator]\nkind = "im', "is not well-formed TOML: "),
    ("cut.json", b'{"estimator": {"kind": "imm", "modes": [', "is not well-formed JSON: "),
    ("cut.yaml", b"estimator: {kind: imm, modes: [", "is not well-formed YAML: "),
    ("bare.toml", b"a = [1, -.25]\n", "is not well-formed TOML: Invalid value (at line 1, column 9): write -0.25, not -.25"),
    ("twice.toml", b"seed = 1\nseed = 2\n", "is not well-formed TOML: Cannot overwrite a value"),
    ("twice.json", b'{"a": {"seed": 1, "x": 2, "seed": 2}}', "is not well-formed JSON: 'seed' appears twice in one table"),
    ("twice.yaml", b"a:\n  seed: 1\n  x: 2\n  seed: 2\n", "is not well-formed YAML: 'seed' appears twice in one table"),
    ("list.json", b"[1, 2]", "must hold a table of names, got list"),
    ("latin.toml", 'title = "caf\xe9"'.encode("latin-1"), "is not UTF-8 text: "),
    ("binary.json", b"\x00\x01\x02", "is not well-formed JSON: "),
    (
        "code.yaml",
        b"seed: !!python/object/apply:os.getcwd []\n",
        "is not well-formed YAML: could not determine a constructor",
    ),
    ("deep.json", b'{"a": ' + b"[" * 100_000 + b"]" * 100_000 + b"}", "is nested deeper than 32 levels"),
    ("deep.toml", b"a = " + b"[" * 100_000 + b"]" * 100_000, "is nested deeper than 32 levels"),
    ("deep.yaml", b"a: " + b"[" * 5_000 + b"]" * 5_000, "is nested deeper than 32 levels"),
    ("int.yaml", b'a: !!int ""', "is not well-formed YAML: "),
    ("bool.yaml", b"a: !!bool x", "is not well-formed YAML: "),
    ("float.yaml", b"a: !!float x", "is not well-formed YAML: "),
    ("time.yaml", b"a: !!timestamp x", "is not well-formed YAML: "),
    ("binary.yaml", b"a: !!binary \xc3\xa9", "is not well-formed YAML: "),
    ("set.yaml", b"a: !!set [x]", "is not well-formed YAML: "),
    ("omap.yaml", b"a: !!omap {x: 1}", "is not well-formed YAML: "),
    ("control.yaml", b"a: \x07\n", "is not well-formed YAML: "),
    ("list_as_name.yaml", b"? [a, b]\n: 1\n", "is not well-formed YAML: "),
    ("date.yaml", b"a: 2020-13-45", "is not well-formed YAML: "),
    ("dotted.toml", b".".join([b"a"] * 100_000) + b" = 1\n", "is not well-formed TOML: a name is nested deeper"),
    ("date.toml", b"a = 2020-02-31\n", "is not well-formed TOML: "),
    ("huge.toml", b"a = " + b"9" * 10_000 + b"\n", "is not well-formed TOML: "),
    ("huge.json", b'{"a": ' + b"9" * 10_000 + b"}", "is not well-formed JSON: "),
    ("large.json", b'{"a": "' + b"x" * 10_000_001 + b'"}', "is larger than 10000000 bytes: this is no config"),
    ("config.ini", b"seed = 1\n", "must end in .toml, .yaml, .yml, .json: the ending tells the format"),
    ("plots.csv", b"t,x,y\n", "is data, not a config; `vedette new config` writes"),
    ("config", b"seed = 1\n", "must end in .toml"),
]


@pytest.mark.parametrize(("name", "content", "piece"), FILES, ids=[name for name, _, _ in FILES])
def test_a_wrong_file_is_refused_by_its_path(
    tmp_path: Path, registry: Registry, name: str, content: bytes, piece: str
) -> None:
    if name.endswith("yaml"):
        pytest.importorskip("yaml")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        load(path, registry)
    (problem,) = caught.value.problems
    assert problem.place == str(path)
    assert problem.text.startswith(piece)
    assert "\n" not in problem.text


def test_a_file_that_is_not_there_and_a_folder_are_refused(tmp_path: Path, registry: Registry) -> None:
    with pytest.raises(ConfigError, match=r"nowhere.toml: there is no such file$"):
        load(tmp_path / "nowhere.toml", registry)
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ConfigError, match=r"folder.toml: is a folder; name the file"):
        load(str(tmp_path / "folder.toml"), registry)
    with pytest.raises(ConfigError, match=r"cannot be read: "):
        load(f"{'x' * 5000}.toml", registry)
    with pytest.raises(ConfigError, match=r"clip\.mp4: there is no"):
        load("clip.mp4")
    with pytest.raises(ConfigError, match=r"must end in .toml"):
        load('seed = 1\ntitle = "text in place of a path"', registry)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_a_file_that_may_not_be_read_is_refused(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "secret.toml"
    path.write_text("seed = 1\n")
    path.chmod(0)
    with pytest.raises(ConfigError, match=r"secret.toml: cannot be read: Permission denied"):
        load(path, registry)


BOMB = (
    "a0: &a0 {"
    + ", ".join(f"k{i}: 1" for i in range(20))
    + "}\n"
    + "".join(f"a{i}: &a{i}\n  <<: [*a{i - 1}, *a{i - 1}, *a{i - 1}]\n" for i in range(1, 16))
)


def test_merges_within_merges_are_counted_before_they_are_made(tmp_path: Path, registry: Registry) -> None:
    """577 bytes of them once took 2.9 GB and 63 s."""
    pytest.importorskip("yaml")
    (tmp_path / "bomb.yaml").write_text(BOMB)
    tracemalloc.start()
    try:
        with pytest.raises(ConfigError, match="its merges"):
            load(tmp_path / "bomb.yaml", registry)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 20e6


def test_merges_that_are_few_are_made(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    (tmp_path / "a.yaml").write_text("a: &a {x: 1, y: 2}\nb:\n  <<: *a\n  y: 3\nc:\n  <<: [*a, {z: 4}]\n")
    assert read_file(tmp_path / "a.yaml")["b"] == {"x": 1, "y": 3}
    assert read_file(tmp_path / "a.yaml")["c"] == {"x": 1, "y": 2, "z": 4}


def test_too_many_values_of_yaml_are_refused_and_the_limit_can_be_raised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("yaml")
    monkeypatch.setattr("vedette.config.texts.MOST_NODES", 1000)
    (tmp_path / "a.yaml").write_text("a: [" + "1, " * 1500 + "]\n")
    with pytest.raises(ConfigError, match="holds more than 1,000 values"):
        read_file(tmp_path / "a.yaml")
    monkeypatch.setenv("VEDETTE_LIMITS", "2")
    assert len(read_file(tmp_path / "a.yaml")["a"]) == 1500


@pytest.mark.parametrize("ending", ["yaml", "json", "toml"])
@pytest.mark.costly
def test_time_grows_with_the_number_of_names_and_no_faster(tmp_path: Path, ending: str) -> None:
    """60,000 of YAML once took over a minute, JSON with a late duplicate its square."""
    if ending == "yaml":
        pytest.importorskip("yaml")
    taken = {}
    for count in (5_000, 40_000):
        names = [f"k{i}" for i in range(count)]
        texts = {
            "yaml": "\n".join(f"{name}: 1" for name in [*names, names[-1]]),
            "json": "{" + ", ".join(f'"{name}": 1' for name in [*names, names[-1]]) + "}",
            "toml": "\n".join(f"{name} = 1" for name in [*names, names[-1]]),
        }
        (tmp_path / f"a.{ending}").write_text(texts[ending])
        taken[count] = seconds(partial(_refused, tmp_path / f"a.{ending}"))
    assert taken[40_000] < 40 * max(taken[5_000], 0.02)


def _refused(path: Path) -> None:
    with pytest.raises(ConfigError):
        read_file(path)
