"""Write what each paper has, where it is here and what verifies it, into docs/measured/papers.md.

The rows are the studies' `elements`; a test holds the page to them.
"""

from __future__ import annotations

from pathlib import Path

from vedette import Registry

PAGE = Path(__file__).parent / "measured" / "papers.md"
BEGIN, END = "<!-- elements -->\n", "<!-- end of elements -->\n"
PAPERS = {"vts": "VTS", "target_oriented": "target-oriented", "bayes_risk": "Bayes risk", "marine": "marine", "flir": "FLIR"}


def table() -> str:
    """Return the table, a row for each element."""
    rows = ["| paper | what it has | where | here | verified by |", "| --- | --- | --- | --- | --- |"]
    for kind, name in PAPERS.items():
        for i, each in enumerate(Registry.installed().get("reproduction", kind).cls.elements):
            parts = ", ".join(f"`{part.split()[1]}`" for part in dict.fromkeys(each.made_of)) or "study"
            checks = "; ".join(map(_told, each.verified))
            rows.append(f"| {name if i == 0 else ''} | {each.what} | {each.where} | {parts} | {checks} |")
    return "\n".join(rows) + "\n"


def _told(verified: str) -> str:
    kind, _, rest = verified.partition(": ")
    if kind == "claim":
        return f"the claim *{rest} ...*"
    if kind == "law":
        return f"the laws of a {rest}"
    path, _, test = verified.partition("::")
    return f"`{test or Path(path).name}`" if path.startswith("tests/") else verified


def page() -> str:
    """Return the page with the table as it is to be."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
