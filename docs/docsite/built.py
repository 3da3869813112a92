"""What stands for `<!-- build: NAME -->` on a page: tables written from the code, so that nobody writes them twice."""

import argparse
import re
from collections.abc import Callable, Iterator

from docsite.reference import ROLES, escaped, table_of
from vedette.cli import _parser
from vedette.config.parameters import parameters
from vedette.config.registry import Registry
from vedette.metrics import FIGURES, OF_OBJECTS, Judge
from vedette.testing import Misuse, laws_of
from vedette.tracking.gate import Gate
from vedette_live.config import Conduct, Sink
from vedette_live.formats.asterix_items import meanings

MARK = re.compile(r"^<!-- build: (?P<name>\w+)(?: (?P<of>\w+))? -->$", re.MULTILINE)


def commands(_: str = "") -> Iterator[str]:
    """Yield a section for each command: what it does, how it is called, its arguments and options."""
    parser = _parser()
    for name, below in sorted(parser.below.items()):
        yield from _command(f"vedette {name}", below)


def _command(name: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    yield f"## {name}"
    yield ""
    yield escaped((parser.description or "").replace("%%", "%"))
    yield ""
    usage = parser.format_usage().removeprefix("usage: ")
    yield f"```text\n{usage.strip()}\n```"
    yield ""
    rows = []
    for action in parser._actions:
        if isinstance(action, argparse._HelpAction):
            continue
        if isinstance(action, argparse._SubParsersAction):
            for below, one in action.choices.items():
                yield from _command(f"{name} {below}", one)
            continue
        shown = action.metavar or (f"{{{','.join(map(str, action.choices))}}}" if action.choices else action.dest)
        value = "" if action.nargs == 0 else f" {shown}" if action.option_strings else str(shown)
        called = f"{', '.join(action.option_strings)}{value}".replace("|", "\\|")
        rows.append(f"| `{called}` | {escaped((action.help or '').replace('%%', '%'))} |")
    if rows:
        yield from ["| argument or option | |", "| --- | --- |", *rows, ""]


def figures(_: str = "") -> Iterator[str]:
    """Yield a table of the figures of a run, and one of those of each object."""
    yield "| figure | unit | | name in studies | right value |"
    yield "| --- | --- | --- | --- | --- |"
    for one in FIGURES:
        right = "" if one.expected is None else f"{one.expected:g}"
        yield f"| `{one.name}` | {one.unit} | {escaped(one.about)} | {f'`{one.study}`' if one.study else ''} | {right} |"
    yield ""
    yield f"Of each object: {', '.join(f'`{one.name}`' for one in OF_OBJECTS)}, and `lost`."


def judge(_: str = "") -> Iterator[str]:
    """Yield the options of the table `judge` of a config."""
    yield from table_of(parameters(Judge))


def gate(_: str = "") -> Iterator[str]:
    """Yield the options of the table `gate` of a config."""
    yield from table_of(parameters(Gate))


def outputs(_: str = "") -> Iterator[str]:
    """Yield the options of a table `[[outputs]]` of a served config."""
    yield from table_of(parameters(Sink))


def service(_: str = "") -> Iterator[str]:
    """Yield the options of the table `[service]` of a served config."""
    yield from table_of(parameters(Conduct))


def laws(_: str = "") -> Iterator[str]:
    """Yield a section for each role that has laws: their names and sentences."""
    registry = Registry.installed()
    for role, (title, _about) in ROLES.items():
        for entry in registry.of_role(role):
            try:
                found = laws_of(entry.cls)
            except Misuse:
                continue
            yield from [f"## {title}", "", "| law | says |", "| --- | --- |"]
            yield from (f"| `{law.name}` | {escaped(law.sentence)}{_only(law.needs)} |" for law in found)
            yield ""
            break


def _only(needs: str) -> str:
    return f" *(if it is {needs.replace('_', ' ')})*" if needs else ""


def kinds(package: str) -> Iterator[str]:
    """Yield a table of the kinds that a package of this repository brings."""
    yield "| role | kind | |"
    yield "| --- | --- | --- |"
    for role in ROLES:
        for entry in sorted(Registry.installed().of_role(role), key=lambda one: one.kind):
            if entry.cls.__module__.partition(".")[0] == package:
                yield f"| {role} | [`{entry.kind}`](kinds/{role}/{entry.kind}.md) | {escaped(entry.summary)} |"


def asterix(_: str = "") -> Iterator[str]:
    """Yield a table of what the items of ASTERIX become, by category; of several the first that a record has is taken."""
    yield "| category | items | become |"
    yield "| --- | --- | --- |"
    yield from (f"| {category:03d} | {items} | {axes} |" for category, items, axes in meanings())


TABLES: dict[str, Callable[[str], Iterator[str]]] = {
    "commands": commands,
    "figures": figures,
    "judge": judge,
    "gate": gate,
    "laws": laws,
    "outputs": outputs,
    "service": service,
    "kinds": kinds,
    "asterix": asterix,
}


def with_tables(text: str, folder: str = "kinds") -> str:
    """Return a page with its marks replaced; one that names no table of these stays for who lays out the page.

    `folder` is where the pages of kinds are, seen from the page.
    """

    def written(match: re.Match[str]) -> str:
        table = TABLES.get(match["name"])
        return match[0] if table is None else "\n".join(table(match["of"] or "")).replace("](kinds/", f"]({folder}/")

    return MARK.sub(written, text)
