"""The page of the papers holds what their studies say that each paper has."""

import importlib.util

from support.paths import ROOT


def test_the_table_is_that_of_the_studies():
    """Else run `python docs/write_papers.py`."""
    spec = importlib.util.spec_from_file_location("write_papers", ROOT / "docs" / "write_papers.py")
    writer = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(writer)
    assert writer.page() == writer.PAGE.read_text(encoding="utf-8")
