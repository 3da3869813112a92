"""Wrong files are refused by their path."""

import os
from pathlib import Path

import pytest

from vedette import ConfigError, Registry
from vedette.config import load

FILES: list[tuple[str, bytes, str]] = [
    ("empty.toml", b"", "the file is empty"),
    ("blank.json", b" \n\n", "the file is empty"),
    ("empty.yaml", b"", "the file is empty"),
    ("comment.yaml", b"# nothing\n", "must hold a table of names, got NoneType"),
    ("cut.toml", b'[estimator]\nkind = "im', "is not well-formed TOML: "),
    ("cut.json", b'{"estimator": {"kind": "imm", "modes": [', "is not well-formed JSON: "),
    ("cut.yaml", b"estimator: {kind: imm, modes: [", "is not well-formed YAML: "),
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
    with pytest.raises(ConfigError, match=r"must end in .toml"):
        load('seed = 1\ntitle = "text in place of a path"', registry)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_a_file_that_may_not_be_read_is_refused(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "secret.toml"
    path.write_text("seed = 1\n")
    path.chmod(0)
    with pytest.raises(ConfigError, match=r"secret.toml: cannot be read: Permission denied"):
        load(path, registry)
