"""Show what of measured speed stands on the users' page: a table, and the others as a chart."""

import re
from pathlib import Path

_PEERS = "FilterPy|Stone Soup|simdkalman|textbook numpy"
_ROW = re.compile(rf"^\| (?P<what>[^|]*?): (?P<own>Vedette[^|]*?) / (?P<peer>{_PEERS}) \| 1/(?P<times>[\d,.]+)")


def users(text: str) -> str:
    """Return the first table of the record: times of whole jobs."""
    return text.partition("<!-- users: begin -->")[2].strip().partition("\n\n")[0]


def speed(text: str, file: Path) -> str:
    """Draw how many times as fast as its peers Vedette is, by the record's own table; return the line that shows it."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    rows = [match for line in text.splitlines() if (match := _ROW.match(line))]
    names = [f"{row['what']}, {row['own'].removeprefix('Vedette, ').replace('`', '')}: {row['peer']}" for row in rows]
    times = [float(row["times"].replace(",", "")) for row in rows]
    peers = sorted({row["peer"] for row in rows})
    figure, axes = plt.subplots(figsize=(9, 0.32 * len(rows) + 1))
    colors = [f"C{peers.index(row['peer'])}" for row in rows]
    axes.barh(names, times, color=colors)
    axes.set(xscale="log", xlabel="a peer's time over Vedette's", title="How many times as fast as its peers")
    axes.invert_yaxis()
    file.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "vedette"}):
        figure.savefig(file, metadata={"Date": None}, bbox_inches="tight")
    plt.close(figure)
    return f"![Times of peers over those of Vedette](pictures/{file.parent.name}/{file.name})"
