"""What an import pulls in, in a process of its own."""

import importlib.util
import json
import subprocess
import sys

import pytest

from support.paths import DOCS

HEAVY = ("scipy.stats", "cv2", "matplotlib", "plotly", "hypothesis", "pytest", "rich", "xarray", "zarr", "dask")


def modules_after(code):
    script = f"{code}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    return json.loads(subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout)


def test_import_vedette_pulls_in_next_to_nothing():
    assert not {"numpy", "attr", "scipy"} & set(modules_after("import vedette"))


@pytest.mark.parametrize(
    "code",
    [
        "import vedette; [getattr(vedette, name) for name in dir(vedette)]",
        "import vedette; vedette.Registry.installed()",
        "import vedette_standard, vedette_sim, vedette_files",
    ],
)
@pytest.mark.by_turns
def test_no_use_short_of_a_report_pulls_in_what_is_heavy(code):
    loaded = modules_after(code)
    assert not [name for name in loaded if name.startswith(HEAVY)]
    assert "vedette.roles" in loaded, "this test looks at something"


def test_every_public_name_is_there():
    import vedette

    for name in dir(vedette):
        assert getattr(vedette, name) is not None
    with pytest.raises(AttributeError, match="module 'vedette' has no attribute 'trakcer'"):
        _ = vedette.trakcer


def test_the_stubs_tell_the_names_of_today():
    spec = importlib.util.spec_from_file_location("write_stub", DOCS / "write_stub.py")
    writing = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(writing)
    for path, text in writing.stubs().items():
        said = sorted(path.read_text(encoding="utf-8").split("\n"))
        assert said == sorted(text.split("\n")), "run `python docs/write_stub.py`"
