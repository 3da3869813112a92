"""Write the reference: a page for each kind of component, from its fields, its docstring and its laws; the API."""

import inspect
import json
import re
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from docsite.pages import ROOT
from vedette.config.contract import Installed
from vedette.config.parameters import parameters, tables
from vedette.config.registry import Registry
from vedette.testing import Misuse, laws_of

ROLES = {
    "motion": ("Motion models", "How a target moves, and how uncertain that is."),
    "sensor": ("Sensors", "What is measured of a state, with which noise, how probably, and among how many false returns."),
    "estimator": ("Estimators", "Filters: how a belief moves on with time and takes returns."),
    "associator": ("Associators", "Which return is which track's."),
    "birth": ("Births", "Where tracks begin, and with which prior."),
    "lifecycle": ("Lifecycles", "When a track is confirmed, and when it ends."),
    "preprocessor": ("Preprocessors", "How raw data of a sensor becomes scans."),
    "source": ("Sources", "Where scans come from: recordings and simulations."),
    "input": ("Inputs", "Where bytes come from while a service runs."),
    "format": ("Formats", "How messages and tracks stand in bytes."),
    "output": ("Outputs", "Where a service sends its tracks."),
    "store": ("Stores", "Where a service keeps states and tracks for a restart."),
    "reproduction": ("Reproductions", "Published studies, run anew."),
    "picture": ("Pictures", "What is drawn of a run, or of a report on consistency."),
}
ROLE_OF = {role: role for role in ROLES} | {"sensors": "sensor", "preprocessors": "preprocessor", "modes": "estimator"}
ROLE_OF |= {"models": "motion", "wander": "motion", "scene": "source"}
LINES = Path(__file__).parent / "lines.toml"
"""A line that builds each kind that no config in `examples` builds, by role."""
_REFERENCE = re.compile(r"^[A-Z][A-Za-z-]+(?: [A-Z][A-Za-z-]+)*, .*", re.MULTILINE)
_SIGNS = {"above": ">", "at_least": "≥", "below": "<", "at_most": "≤"}


def escaped(text: str) -> str:
    """Return plain text of a docstring as Markdown that shows it letter by letter, `names` as code."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(part if i % 2 else _letters(part) for i, part in enumerate(parts))


def _letters(text: str) -> str:
    marked = re.sub(r"([\\*_\[\]{}#>])", r"\\\1", text)
    return marked.replace("<", "&lt;").replace("|", "&#124;")


def _halves(docstring: str) -> tuple[str, str]:
    """Return what a docstring says after its first line, and the reference with which it ends, or ""."""
    body = inspect.cleandoc(docstring).partition("\n")[2].strip()
    for match in reversed(list(_REFERENCE.finditer(body))):
        before, tail = body[: match.start()].rstrip(), body[match.start() :]
        if before and before[-1] not in ".:":  # amid a reference: a title over two lines, the second of two
            continue
        if re.search(r"\b(18|19|20)\d\d\b", tail) and "\n\n" not in tail.strip():
            return before, " ".join(tail.split())
    return body, ""


def examples() -> dict[tuple[str, str], tuple[str, str]]:
    """Return for each role and kind a line that builds it, and the example where it stands, or ""."""
    found: dict[tuple[str, str], tuple[str, str]] = {}
    for role, lines in tomllib.loads(LINES.read_text(encoding="utf-8")).items():
        found |= {(role, kind): (_line({"kind": kind} | given), "") for kind, given in lines.items()}
    for file in sorted((ROOT / "examples").rglob("*.toml")):
        for where, table in _tables(tomllib.loads(file.read_text(encoding="utf-8")), ""):
            kind, role = str(table["kind"]), _role(where)
            found.setdefault((role, kind), (_line(table), file.relative_to(ROOT).as_posix()))
    return found


def _tables(value: Any, where: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the components of a config, with the keys that lead to them."""
    if isinstance(value, dict):
        if isinstance(value.get("kind"), str):
            yield where, value
        for key, inner in value.items():
            yield from _tables(inner, f"{where}.{key}")
    elif isinstance(value, list):
        for inner in value:
            yield from _tables(inner, where)


def _role(where: str) -> str:
    """Return the role of what stands at some place of a config: the last key that names one decides."""
    return next((ROLE_OF[key] for key in reversed(where.split(".")) if key in ROLE_OF), "")


def _line(value: Any) -> str:
    """Return a value as TOML within a line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_line(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_line, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def _limits(about: dict[str, Any]) -> str:
    bounds = [f"{_SIGNS[name]} {bound:g}" for name, bound in about.get("limits", {}).items()]
    options = [f"one of {', '.join(f'`{option}`' for option in about['options'])}"] if "options" in about else []
    return ", ".join([*bounds, *options])


def table_of(rows: tuple[Any, ...]) -> Iterator[str]:
    """Yield a table of parameters."""
    yield "| parameter | meaning | unit | values | default |"
    yield "| --- | --- | --- | --- | --- |"
    for parameter in rows:
        about = parameter.describe()
        default = "required" if about["required"] else f"`{_line(about.get('default'))}`".replace("`null`", "none")
        unit = "" if about["unit"] in ("", "1") else f"{about['unit']}"
        cells = (escaped(about["doc"]), escaped(unit), f"{about['type']}{', ' * bool(_limits(about))}{_limits(about)}")
        yield f"| `{about['name']}` | {' | '.join(cells)} | {default.replace('|', '&#124;')} |"
    yield ""


def page(entry: Installed, example: tuple[str, str] | None) -> str:
    """Return the page of a kind."""
    said, worked, example_of_use = inspect.cleandoc(entry.cls.__doc__ or "").partition("\n\n>>> ")
    body, reference = _halves(said)
    out = [
        f"# {entry.kind}",
        "",
        f"*{ROLES[entry.role][0]}* · `{entry.distribution} {entry.version}`",
        "",
        escaped(entry.summary),
    ]
    if entry.cls.misprint:
        out += ["", f"**Not for use.** {escaped(entry.cls.misprint)}"]
    if body:
        for part in body.split("\n\n"):
            out += ["", f"```pycon\n{part}\n```" if part.startswith(">>>") else escaped(part)]
    if reference:
        out += ["", "## Reference", "", escaped(reference)]
    out += ["", "## Parameters", ""]
    out += list(table_of(entry.parameters)) if entry.parameters else ["It takes none.", ""]
    for cls in tables(entry.parameters):
        out += [
            f"### Table {cls.__name__}",
            "",
            escaped((cls.__doc__ or "").strip().partition("\n")[0]),
            "",
            *table_of(parameters(cls)),
        ]
    if example:
        line, file = example
        where = f" As in [{file}](../../../{file}):" if file else ""
        out += [
            "## Example",
            "",
            f"In a config, as a component of the role {entry.role}.{where}",
            "",
            "```toml",
            f"{entry.role} = {line}",
            "```",
            "",
        ]
    if worked:
        out += ["## Worked example", "", "```pycon", f">>> {example_of_use}", "```", ""]
    if entry.role == "reproduction":
        out += ["## Example", "", "```text", f"vedette reproduce {entry.kind.replace('_', '-')}", "```", ""]
    out += _laws(entry)
    file = entry.cls.__module__.replace(".", "/")
    places = [(folder, file + end) for folder in ("core", "plugins", "simulators") for end in (".py", "/__init__.py")]
    folder, file = next((folder, file) for folder, file in places if (ROOT / folder / file).exists())
    name = f"{entry.cls.__module__}.{entry.cls.__qualname__}"
    return "\n".join([*out, "## Source", "", f"`{name}` in [{folder}/{file}](../../../{folder}/{file})", ""])


def _laws(entry: Installed) -> list[str]:
    """Return what the kit tests of the class: laws that a class does not claim are left out."""
    try:
        laws = laws_of(entry.cls)
    except Misuse:
        return []
    own = [law for law in laws if not law.needs or getattr(entry.cls, law.needs, None) is not False]
    out = [
        "## Laws",
        "",
        f"The tests hold it to these, and `vedette check {entry.kind}` tries them ([the laws](../../conformance.md)):",
        "",
    ]
    for law in own:
        only = (
            ""
            if not law.needs or getattr(entry.cls, law.needs, None) is True
            else f" *(if it is {law.needs.replace('_', ' ')})*"
        )
        out.append(f"- `{law.name}`: {escaped(law.sentence)}{only}")
    return [*out, ""]


def kinds(folder: Path) -> list[Any]:
    """Write the pages of all kinds into `folder`/kinds, and return their part of the navigation."""
    registry, known, nav = Registry.installed(), examples(), []
    overview = [
        "# Components",
        "",
        "Every kind that Vedette brings, by role: what it computes, its parameters, a line that builds it.",
    ]
    for role, (title, what) in ROLES.items():
        entries = [entry for entry in registry.of_role(role) if entry.distribution == "vedette"]
        overview += ["", f"## {title}", "", what, "", "| kind | | for example |", "| --- | --- | --- |"]
        (folder / "kinds" / role).mkdir(parents=True, exist_ok=True)
        pages = []
        for entry in sorted(entries, key=lambda entry: entry.kind):
            name = f"kinds/{role}/{entry.kind}.md"
            (folder / name).write_text(page(entry, known.get((role, entry.kind))), encoding="utf-8")
            line, file = known.get((role, entry.kind), ("", ""))
            example = f"[{file}](../../{file})" if file else f"`{line}`" if line else ""
            overview.append(f"| [`{entry.kind}`]({role}/{entry.kind}.md) | {escaped(entry.summary)} | {example} |")
            pages.append({entry.kind: name})
        nav.append({title: pages})
    (folder / "kinds" / "index.md").write_text("\n".join([*overview, ""]), encoding="utf-8")
    return [{"Overview": "kinds/index.md"}, *nav]


def api(folder: Path, public: tuple[str, ...]) -> list[Any]:
    """Write a page for each public module into `folder`/api, and return their part of the navigation."""
    (folder / "api").mkdir(parents=True, exist_ok=True)
    overview = ["# API", "", "What plugins, programs and notebooks may import. Everything else may move without notice.", ""]
    nav: list[Any] = [{"Overview": "api/index.md"}]
    for name in public:
        module = import_module(name)
        summary = (module.__doc__ or "").strip().partition("\n")[0]
        lines = [f"# {name}", "", escaped(summary), ""]
        for path in sorted(_public(module, name), key=str.lower):
            lines += [f"::: {path}", ""]
        (folder / "api" / f"{name}.md").write_text("\n".join(lines), encoding="utf-8")
        overview.append(f"- [`{name}`]({name}.md): {escaped(summary)}")
        nav.append({name: f"api/{name}.md"})
    (folder / "api" / "index.md").write_text("\n".join([*overview, ""]), encoding="utf-8")
    return nav


def _public(module: Any, name: str) -> set[str]:
    """Return where the classes and functions of a module, or those that it passes on, are defined."""
    found = set()
    for attribute in getattr(module, "__all__", None) or dir(module):
        value = None if attribute.startswith("_") else getattr(module, attribute)
        home = getattr(value, "__module__", None) or ""
        if (inspect.isclass(value) or inspect.isfunction(value)) and home.partition(".")[0] == "vedette":
            found.add(f"{home}.{value.__qualname__}")
    return found
