"""All that a paper has is named by its study, with what verifies it: no equation, table, figure or claim is forgotten."""

import re

import pytest

from support.paths import ROOT
from vedette import Registry
from vedette_bayes_risk import verdicts as bayes_risk
from vedette_flir import verdicts as flir
from vedette_marine import verdicts as marine
from vedette_marine.outcome import FILTERS, PUBLISHED
from vedette_report.findings import Cell
from vedette_target_oriented import processes
from vedette_target_oriented import verdicts as target_oriented
from vedette_vts import verdicts as vts

PRINTED = {
    "vts": {"equation": 25, "table": 2, "figure": 6},
    "target_oriented": {"equation": 9, "table": 1, "figure": 5},
    "bayes_risk": {"equation": 6, "table": 2, "figure": 4},
    "flir": {"equation": 14, "table": 0, "figure": 3},
    "marine": {"equation": 34, "table": 6, "figure": 7},
}
"""How many numbered equations, tables and figures each paper has."""


class AnyFigure(dict):
    """A figure for whatever a study's claims ask for."""

    def __missing__(self, key):
        return Cell(0.9, 0.1)


def marine_figures():
    made = AnyFigure({("error", target): Cell(1.0) for target in PUBLISHED})
    made |= {("late lost",): Cell(1.0), ("late", "MANV-like boat 1", *FILTERS[:2]): Cell(1.0)}
    return made


CLAIMS = {
    "vts": lambda: vts.claims(AnyFigure(), 10),
    "target_oriented": lambda: (*target_oriented.claims(AnyFigure(), 10), *processes.claims(AnyFigure(), 10)),
    "bayes_risk": lambda: bayes_risk.claims(AnyFigure(), 10, 10),
    "flir": lambda: flir.claims(AnyFigure({"spread 1, 3 px, 2 s lost": Cell(0.5)}), 10),
    "marine": lambda: marine.claims(marine_figures(), 10),
}


def elements(paper):
    return Registry.installed().get("reproduction", paper).cls.elements


def numbers(where, word):
    """The numbers after a word and its plural: "equations 11 to 13 and 20 to 25" are nine."""
    found = set()
    for part in re.findall(rf"{word}s? ((?:\d+[^;]*))", where):
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", part):
            found |= set(range(int(first), int(last or first) + 1))
    return found


@pytest.mark.parametrize("paper", PRINTED)
@pytest.mark.parametrize("word", ["equation", "table", "figure"])
def test_every_numbered_thing_is_named(paper, word):
    named = set().union(*(numbers(each.where, word) for each in elements(paper)))
    assert named == set(range(1, PRINTED[paper][word] + 1))


@pytest.mark.parametrize("paper", PRINTED)
def test_every_claim_is_that_of_an_element_and_every_element_is_verified(paper):
    claims = [claim.text for claim in CLAIMS[paper]()]
    named = set()
    for each in elements(paper):
        assert each.verified, each.what
        for said in each.verified:
            if said.startswith("claim: "):
                found = [text for text in claims if text.startswith(said.removeprefix("claim: "))]
                assert len(found) == 1, said
                named |= set(found)
            elif said.startswith("law: "):
                assert any(part.split()[0] == said.removeprefix("law: ") for part in each.made_of), said
            elif said.startswith("tests/"):
                path, _, test = said.partition("::")
                assert not test or f"def {test}(" in (ROOT / path).read_text(), said
                assert (ROOT / path).exists(), said
    assert named == set(claims)
