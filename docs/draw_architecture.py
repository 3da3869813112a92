"""Draw docs/architecture.svg from the imports in the code: `python docs/draw_architecture.py`.

Each room of the core is a box and each import an arrow. Dark arrows are those that no detour says already; pale ones are the
other direct imports. What all rooms may use is one box at the bottom, without arrows. Every arrow is a group whose id is
`importer.imported`: tests/test_drawn_architecture.py compares them with the code.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"

GROUND = (
    "display", "errors", "fields", "given", "names", "progress", "limits", "space", "types", "units", "values",
)  # fmt: skip
"""What all rooms may use, drawn as one."""
FRONT = ("__main__", "cli", "commands")
"""The command line, drawn as one."""

PLACES: dict[str, tuple[float, float, str]] = {
    "commands": (3.4, 9.0, "the frame of commands, info"),
    "testing": (1.2, 8.0, "laws, consistency of trackers"),
    "config": (3.6, 7.0, "from plain data to components"),
    "experiment": (2.3, 6.0, "tracker, source and judge"),
    "metrics": (5.85, 5.0, "how good tracks are"),
    "tracking": (1.7, 5.0, "the loop: scan by scan"),
    "filters": (0.55, 4.0, "an estimator author's toolbox"),
    "sampling": (3.0, 4.0, "draws from models"),
    "hypotheses": (2.4, 3.0, "associators of many scans"),
    "supporting": (0.7, 3.0, "births, lifecycles, commands, ..."),
    "wrapping": (4.1, 3.0, "a part around another"),
    "streams": (5.4, 4.0, "live runs: inputs, outputs"),
    "roles": (2.9, 2.0, "the contract: four roles"),
    "kernels": (5.2, 1.0, "inner loops, numpy and C++"),
    "ground": (3.1, 0.0, " \u00b7 ".join(GROUND)),
}
"""Where each box of the core stands, its middle, and what it is for."""

PAPERS = ("vedette_bayes_risk", "vedette_boxes", "vedette_flir", "vedette_marine", "vedette_target_oriented", "vedette_vts")
"""One plugin a paper, drawn as one."""
LAYERS: dict[str, tuple[float, float, str]] = {
    "vedette_sim": (3.1, 16.4, "scenes drawn from the models"),
    "papers": (3.1, 15.5, "one plugin a paper: bayes_risk, flir, marine, ..."),
    "vedette_tools": (1.6, 14.6, "new, explain, tune"),
    "vedette_live": (3.9, 14.6, "serve, replay"),
    "vedette_adapters": (6.2, 14.6, "other libraries' objects"),
    "vedette_boxes": (6.2, 13.7, "boxes that detectors give"),
    "vedette_study": (1.6, 13.7, "study, reproduce"),
    "vedette_report": (1.6, 12.8, "run, report, watch, export; pictures"),
    "vedette_files": (1.6, 11.9, "recordings, tables, tracks"),
    "vedette_standard": (4.6, 11.0, "the classics, one component a file"),
}
"""Where each plugin stands, and what it is for."""


def sources(folder: Path) -> Iterator[tuple[Path, ast.Module]]:
    """Yield the modules below a folder."""
    for path in sorted(folder.rglob("*.py")):
        yield path.relative_to(folder), ast.parse(path.read_text(encoding="utf-8"))


def homes() -> dict[str, str]:
    """Return of each name of `vedette` the module that it is imported from."""
    tree = ast.parse((ROOT / "core/vedette/__init__.pyi").read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    return {a.name: f"vedette.{a.name}" if n.module == "vedette" else str(n.module) for n in found for a in n.names}


def imported(tree: ast.Module, known: dict[str, str]) -> Iterator[str]:
    """Yield the modules of the core that a module imports, within functions and for type checkers only included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.partition(".")[0] == "vedette")
        elif isinstance(node, ast.ImportFrom) and node.module == "vedette":
            homes = (known.get(alias.name, f"vedette.{alias.name}") for alias in node.names)
            yield from (home for home in homes if home.partition(".")[0] == "vedette")
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "vedette":
            yield str(node.module)


def room(module: str) -> str:
    """Return the box of a module: the room of the core that it is in."""
    name = module.split(".")[1] if "." in module else "commands"  # `import vedette` as a whole is the front's
    return "ground" if name in (*GROUND, "_values") else "commands" if name in FRONT else name


@cache
def arrows() -> set[tuple[str, str]]:
    """Return which room of the core imports which, today; what all may use is not told."""
    known, found = homes(), set()
    for path, tree in sources(ROOT / "core/vedette"):
        if path.name == "__init__.py" and len(path.parts) == 1:
            continue  # `vedette` itself only says where its names are
        here = room("vedette." + path.parts[0].removesuffix(".py"))
        found |= {(here, room(module)) for module in imported(tree, known)}
    return {(here, there) for here, there in found if here != there and there != "ground"}


def layer(package: str) -> str:
    """Return the box of a plugin or of the simulators."""
    return "papers" if package in PAPERS else package


def arrows_of_plugins() -> set[tuple[str, str]]:
    """Return which plugin imports which, today."""
    found = set()
    for path, tree in (*sources(ROOT / "plugins"), *sources(ROOT / "simulators")):
        here = layer(path.parts[0])
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vedette_"):
                found.add((here, layer(str(node.module).partition(".")[0])))
    return {(here, there) for here, there in found if here != there}


def needed(all_arrows: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """Return the arrows that no path of others goes along: from box to box they say the same."""
    nexts: dict[str, set[str]] = {}
    for here, there in all_arrows:
        nexts.setdefault(here, set()).add(there)

    def reaches(start: str, goal: str, seen: set[str]) -> bool:
        return any(
            step == goal or (step not in seen and reaches(step, goal, seen | {step})) for step in nexts.get(start, ())
        )

    return {(a, b) for a, b in all_arrows if not any(reaches(step, b, {a, step}) for step in nexts[a] - {b})}


def draw(path: Path) -> None:
    """Draw all of it into a file, whose ending says the format."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

    plt.rcParams |= {"svg.hashsalt": "vedette", "svg.fonttype": "path", "font.family": "DejaVu Sans"}
    height = 0.62
    widths = {name: 6.9 if name == "ground" else 1.62 for name in PLACES}
    figure, axes = plt.subplots(figsize=(11.5, 13.6))
    axes.set(xlim=(-0.75, 6.95), ylim=(-0.65, 16.95))
    axes.set_axis_off()

    def box(x: float, y: float, wide: float, high: float, face: str, edge: str, level: int) -> None:
        shape = "round,pad=0,rounding_size=0.12"
        corner = (x - wide / 2, y - high / 2)
        axes.add_patch(
            FancyBboxPatch(corner, wide, high, boxstyle=shape, facecolor=face, edgecolor=edge, lw=1.1, zorder=level)
        )

    def arrow(name: str, start: tuple[float, float], end: tuple[float, float], colour: str, wide: float, level: int) -> None:
        bow = 0.0 if abs(start[0] - end[0]) > 0.05 or start[1] - end[1] < 1.2 else 0.18
        patch = FancyArrowPatch(
            start, end, arrowstyle="-|>,head_length=5,head_width=2.4", connectionstyle=f"arc3,rad={bow}",
            color=colour, lw=wide, zorder=level, shrinkA=0, shrinkB=1,
        )  # fmt: skip
        patch.set_gid(name)
        axes.add_patch(patch)

    def linked(places: dict[str, tuple[float, float, str]], every: set[tuple[str, str]], strong: str, faint: str) -> None:
        dark = needed(every)
        for here, there in sorted(every):
            (x0, y0, _), (x1, y1, _) = places[here], places[there]
            lean = max(-0.6, min(0.6, 0.3 * (x1 - x0)))
            start, end = (x0 + lean, y0 - height / 2), (x1 - lean, y1 + height / 2)
            look = (strong, 1.7, 3) if (here, there) in dark else (faint, 0.8, 1)
            arrow(f"{here}.{there}", start, end, *look)

    def words(x: float, y: float, label: str, what: str, first: str, second: str) -> None:
        axes.text(x, y + 0.1, label, ha="center", va="center", fontsize=11, weight="bold", color=first, zorder=5)
        axes.text(x, y - 0.15, what, ha="center", va="center", fontsize=7.2, color=second, zorder=5)

    linked(PLACES, arrows(), "#1f4e79", "#d3dee9")
    for name, (x, y, what) in PLACES.items():
        box(x, y, widths[name], height, "#eef3f8" if name == "ground" else "#dce8f4", "#1f4e79", 4)
        words(x, y, "what all may use" if name == "ground" else name, what, "#12304d", "#33475b")
    linked(LAYERS, arrows_of_plugins(), "#b5701a", "#ecdcc4")
    for name, (x, y, what) in LAYERS.items():
        box(x, y, 2.7, height, "#fdf0dc", "#b5701a", 4)
        words(x, y, name, what, "#6b3f08", "#7a5420")
    box(3.1, 4.5, 7.5, 10.1, "#fbfcfe", "#9fb4c8", 0)
    axes.text(6.75, 9.3, "core: vedette", ha="right", va="center", fontsize=10, style="italic", color="#5a7186")
    arrow("plugins.core", (4.6, 10.69), (4.6, 9.57), "#b5701a", 1.7, 3)
    figure.savefig(path, bbox_inches="tight", dpi=110, metadata={"Date": None} if path.suffix == ".svg" else None)
    plt.close(figure)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
