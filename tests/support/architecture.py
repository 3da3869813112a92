"""What imports what, read from the sources: imports within functions and for type checkers only count too."""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from support.paths import ROOT

CORE = (
    "vedette",
    "vedette.commands",
    "vedette.commands.options",
    "vedette.config",
    "vedette.config.parameters",
    "vedette.display",
    "vedette.errors",
    "vedette.experiment",
    "vedette.fields",
    "vedette.filters",
    "vedette.hypotheses",
    "vedette.kernels",
    "vedette.limits",
    "vedette.metrics",
    "vedette.names",
    "vedette.progress",
    "vedette.roles",
    "vedette.sampling",
    "vedette.space",
    "vedette.streams",
    "vedette.supporting",
    "vedette.testing",
    "vedette.testing.bands",
    "vedette.testing.truth",
    "vedette.tracking",
    "vedette.types",
    "vedette.units",
)
"""The modules of the core that others than the core may import; docs/architecture.md names them."""

PLUGINS = (
    "vedette_files",
    "vedette_files.archives",
    "vedette_files.files_read",
    "vedette_files.images.header",
    "vedette_files.images.jpeg",
    "vedette_files.images.png",
    "vedette_files.input_files",
    "vedette_files.json_values",
    "vedette_files.libraries",
    "vedette_files.readers",
    "vedette_files.results",
    "vedette_files.tables.columnar",
    "vedette_files.tables.composed",
    "vedette_files.tables.numbers",
    "vedette_files.tables.rows",
    "vedette_files.tables.times",
    "vedette_files.writing",
    "vedette_marine",
    "vedette_marine.ais",
    "vedette_marine.geometry",
    "vedette_report.columns",
    "vedette_report.consistency",
    "vedette_report.detector_errors.in_time",
    "vedette_report.detector_errors.in_tracks",
    "vedette_report.drawing.brought",
    "vedette_report.drawing.canvas",
    "vedette_report.figures",
    "vedette_report.findings",
    "vedette_report.identity",
    "vedette_report.noises",
    "vedette_report.output",
    "vedette_report.page",
    "vedette_report.progress",
    "vedette_report.provenance",
    "vedette_report.running.files",
    "vedette_report.running.lagging",
    "vedette_report.series.recorder",
    "vedette_report.summary.words",
    "vedette_report.warnings.rehearsal",
    "vedette_report.warnings.words",
    "vedette_report.watching.page",
    "vedette_report.watching.picking",
    "vedette_report.watching.real_time",
    "vedette_standard",
    "vedette_standard.particles",
    "vedette_standard.points",
    "vedette_standard.whole_tracks",
    "vedette_study.executors",
    "vedette_study.grid",
    "vedette_study.lockstep",
    "vedette_study.over_runs",
    "vedette_study.panels",
    "vedette_study.plan",
    "vedette_study.scenes",
    "vedette_study.starts",
    "vedette_study.store",
    "vedette_tools.drafting.trial",
)
"""The modules of plugins that the plugins above them may import."""

PUBLIC = (*CORE, *PLUGINS)


def modules(folder: Path) -> dict[str, Path]:
    """Return the modules below a folder of packages, by their dotted names."""
    found = {}
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(folder).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def core() -> dict[str, Path]:
    """Return the modules of the core."""
    return {name: path for name, path in modules(ROOT / "core").items() if name.partition(".")[0] == "vedette"}


def all_of_vedette() -> dict[str, Path]:
    """Return the modules of the core, the plugins and the simulators."""
    return {name: path for folder in ("core", "plugins", "simulators") for name, path in modules(ROOT / folder).items()}


def imported(source: str, known: Mapping[str, Path]) -> Iterator[str]:
    """Yield the known modules that a source imports: `from a import b` is of a.b where that is a module, else of a."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                if inner in known and not (node.module in known and _binds(known[node.module], alias.name)):
                    yield inner
                elif node.module in known:
                    yield node.module


@cache
def _binds(package: Path, name: str) -> bool:
    """Return whether a package imports a name that a module of it has, too: `vedette.config.parameters`."""
    tree = ast.parse(package.read_text(encoding="utf-8"))
    return any(isinstance(node, ast.ImportFrom) and name in [alias.name for alias in node.names] for node in ast.walk(tree))


def imports(found: Mapping[str, Path]) -> dict[str, set[str]]:
    """Return of each module which of the others it imports."""
    return {name: set(imported(path.read_text(encoding="utf-8"), found)) - {name} for name, path in found.items()}


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that reach each other, each in order of their names."""
    reached = {name: _reached(graph, name) for name in graph}
    groups = {
        frozenset(other for other in reached[name] if name in reached[other]) for name in graph if name in reached[name]
    }
    return sorted(sorted(group) for group in groups)


def _reached(graph: Mapping[str, set[str]], name: str) -> set[str]:
    found: set[str] = set()
    todo = [*graph[name]]
    while todo:
        following = todo.pop()
        if following not in found:
            found.add(following)
            todo += graph[following]
    return found


@cache
def lines_of_code(path: Path) -> int:
    """Count the lines of a file without blanks, comments and docstrings."""
    text = path.read_text(encoding="utf-8")
    lines = set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.string.strip() and token.type != tokenize.COMMENT:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        for line in getattr(node, "body", []) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) else []:
            if isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str):
                lines -= {*range(line.lineno, (line.end_lineno or line.lineno) + 1)}
    return len(lines)
