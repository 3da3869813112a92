"""The table at the top of the page on plugins names methods that the classes have."""

import re

import vedette
from support.paths import DOCS

ROW = re.compile(r"^\| [^|`]+ \| (?P<classes>[^|]*`[^|]*) \| (?P<methods>[^|]+) \|$", re.MULTILINE)
NAME = re.compile(r"`(\w+)`")


def test_what_an_author_writes_is_of_the_class_that_he_derives_from():
    rows = ROW.findall((DOCS / "write-a-plugin.md").read_text(encoding="utf-8").partition("## 1.")[0])
    assert len(rows) == 10
    for classes, methods in rows:
        bases = [getattr(vedette, name, None) or getattr(vedette.filters, name) for name in NAME.findall(classes)]
        for method in NAME.findall(methods):
            assert all(hasattr(base, method) for base in bases), f"{classes}: no {method}"
