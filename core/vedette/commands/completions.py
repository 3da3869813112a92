"""`vedette completions`: what a shell offers after TAB, written out from the arguments of the commands."""

from __future__ import annotations

from argparse import Action, ArgumentParser, Namespace, _SubParsersAction
from collections.abc import Iterator
from shlex import quote

from attrs import frozen

from vedette.commands.ending import DONE
from vedette.config.registry import Registry

CONFIGS, TABLES = "toml|yaml|yml|json", "csv|parquet"
FILES = {"CONFIG": CONFIGS, "STUDY": CONFIGS, "DATA": TABLES, "RUN_DIR": "npz", "FILE": "toml|json|html|mplstyle|geojson"}
"""The endings of the files that a metavar stands for; a directory is always offered with them."""


@frozen
class Place:
    """One option or positional argument: its flags, its help, and what is offered: words, endings of files, or nothing."""

    flags: tuple[str, ...]
    text: str
    words: tuple[str, ...] = ()
    endings: str = ""
    folders: bool = False
    takes: bool = True

    @property
    def offers(self) -> bool:
        """Whether there is something to offer."""
        return bool(self.words or self.endings or self.folders)


@frozen
class Node:
    """A command: the words that lead to it, its help, its options and positional arguments, and the commands below it."""

    path: tuple[str, ...]
    text: str
    options: tuple[Place, ...]
    given: tuple[Place, ...]
    below: tuple[Node, ...]

    @property
    def name(self) -> str:
        """The words that lead to it, as one."""
        return " ".join(self.path)

    def all(self) -> Iterator[Node]:
        """Yield it and all below it."""
        yield self
        for node in self.below:
            yield from node.all()


def run(arguments: Namespace) -> int:
    """Print the script of a shell."""
    print({"bash": bash, "zsh": zsh, "fish": fish}[arguments.shell](tree(arguments.parser)), end="")
    return DONE


def tree(parser: ArgumentParser) -> Node:
    """Return the commands of a parser, with the kinds that are installed."""
    kinds: dict[str, list[str]] = {}
    for entry in Registry.installed():
        kinds.setdefault(entry.role, []).append(entry.kind)
    every = sorted({kind for role, names in kinds.items() for kind in names if role != "reproduction"})
    words = {"PAPER": sorted(kinds.get("reproduction", [])), "ROLE_OR_KIND": [*kinds, *every], "WHAT": every}
    return _node(parser, (), "", {name: tuple(dict.fromkeys(found)) for name, found in words.items()})


def _node(parser: ArgumentParser, path: tuple[str, ...], text: str, words: dict[str, tuple[str, ...]]) -> Node:
    options: list[Place] = []
    given: list[Place] = []
    below: list[Node] = []
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
            below = [_node(one, (*path, name), helps.get(name, ""), words) for name, one in action.choices.items()]
        else:
            (options if action.option_strings else given).append(_place(action, words))
    return Node(path, text, tuple(options), tuple(given), tuple(below))


def _place(action: Action, words: dict[str, tuple[str, ...]]) -> Place:
    metavar = str(action.metavar or "")
    offered = tuple(map(str, action.choices)) if action.choices is not None else words.get(metavar, ())
    text = " ".join((action.help or "").split()).replace("%%", "%")
    folders = metavar in ("DIR", "RUN_DIR")
    endings = CONFIGS if metavar == "WHAT" else FILES.get(metavar, "")
    return Place(tuple(action.option_strings), text, offered, endings, folders, action.nargs != 0)


def _lead(root: Node, shape: str) -> str:
    """Return the lines of a `case` that follow the words into the commands."""
    return "\n".join(
        f"            {shape.format(quote(f'{node.name}/{child.path[-1]}'))} at={quote(child.name)};;"
        for node in root.all()
        for child in node.below
    )


def bash(root: Node) -> str:
    """Return the script for bash, of which each line offers for one place."""
    values, rest = [], []
    for node in root.all():
        for option in node.options:
            if option.takes:
                values += [f"        {quote(f'{node.name}/{flag}')}) {_bash(option)}; return;;" for flag in option.flags]
        flags = " ".join(flag for option in node.options for flag in option.flags)
        words = tuple(child.path[-1] for child in node.below)
        place = Place((), "", words) if words else next((one for one in node.given if one.offers), Place((), ""))
        rest.append(
            f"        {quote(node.name)}) case $cur in -*) _vedette_words {quote(flags)};; *) {_bash(place)};; esac;;"
        )
    return _BASH.format(lead=_lead(root, "{})"), values="\n".join(values), rest="\n".join(rest))


def _bash(place: Place) -> str:
    steps = [f"_vedette_words {quote(' '.join(place.words))}"] if place.words else []
    steps += [f"_vedette_files {quote(place.endings)}"] if place.endings else []
    steps += ["_vedette_folders"] if place.folders and not place.endings else []
    return "; ".join(steps) or ":"


def zsh(root: Node) -> str:
    """Return the script for zsh, with the help of each command and option."""
    values, rest = [], []
    for node in root.all():
        for option in node.options:
            if option.takes:
                values += [f"        ({quote(f'{node.name}/{flag}')}) {_zsh(option)}; return;;" for flag in option.flags]
        listed = " ".join(_described(flag, option.text) for option in node.options for flag in option.flags)
        below = " ".join(_described(child.path[-1], child.text) for child in node.below)
        place = next((one for one in node.given if one.offers), Place((), ""))
        other = f"found=({below}); _describe command found" if below else _zsh(place)
        flagged = f"if [[ $cur == -* ]]; then found=({listed}); _describe option found"
        rest.append(f"        ({quote(node.name)}) {flagged}; else {other}; fi;;")
    return _ZSH.format(lead=_lead(root, "({})"), values="\n".join(values), rest="\n".join(rest))


def _described(word: str, text: str) -> str:
    return quote(word.replace(":", "\\:") + ":" + text.replace(":", "\\:"))


def _zsh(place: Place) -> str:
    steps = [f"compadd -- {' '.join(map(quote, place.words))}"] if place.words else []
    steps += [f"_files -g '*.({place.endings})(-.)'"] if place.endings else []
    steps += ["_directories"] if place.folders and not place.endings else []
    return "; ".join(steps) or "_message 'a value'"


def fish(root: Node) -> str:
    """Return the script for fish: a line for each command, option and argument."""
    lines = [
        "# What fish offers after TAB: vedette completions fish > ~/.config/fish/completions/vedette.fish",
        "complete -c vedette -f",
    ]
    for node in root.all():
        seen = [f"__fish_seen_subcommand_from {word}" for word in node.path]
        below = [child.path[-1] for child in node.below]
        here = [*seen, *([f"not __fish_seen_subcommand_from {' '.join(below)}"] if below else [])]
        start = f"complete -c vedette -n {quote('; and '.join(here) or 'true')}"
        lines += [f"{start} -a {quote(child.path[-1])} -d {quote(child.text)}" for child in node.below]
        for option in node.options:
            flags = " ".join(f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}" for flag in option.flags)
            lines.append(f"{start} {flags}{' -x' if option.takes else ''}{_fish(option)} -d {quote(option.text)}")
        lines += [f"{start}{_fish(one)} -d {quote(one.text)}" for one in node.given if one.offers]
    return "\n".join(lines) + "\n"


def _fish(place: Place) -> str:
    found = f" -a {quote(' '.join(place.words))}" if place.words else ""
    if place.endings:
        suffixes = " ".join(f".{ending}" for ending in place.endings.split("|"))
        return found + f" -k -a {quote(f'(for s in {suffixes}; __fish_complete_suffix $s; end)')}"
    return found + (" -a '(__fish_complete_directories)'" if place.folders else "")


_BASH = """\
# What bash offers after TAB. Put it into your shell: eval "$(vedette completions bash)"
_vedette_words() {{ COMPREPLY+=($(compgen -W "$1" -- "$cur")); }}
_vedette_folders() {{ local IFS=$'\\n'; compopt -o filenames 2> /dev/null; COMPREPLY+=($(compgen -d -- "$cur")); }}
_vedette_files() {{
    _vedette_folders
    local IFS=$'\\n'
    COMPREPLY+=($(compgen -f -- "$cur" | grep -E "\\.($1)\\$"))
}}
_vedette() {{
    local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} at='' word
    COMPREPLY=()
    for word in "${{COMP_WORDS[@]:1:COMP_CWORD - 1}}"; do
        case "$at/$word" in
{lead}
        esac
    done
    case "$at/$prev" in
{values}
    esac
    case $at in
{rest}
    esac
}}
complete -F _vedette vedette
"""

_ZSH = """\
#compdef vedette
# What zsh offers after TAB. Put it into your shell, after compinit: eval "$(vedette completions zsh)"
_vedette() {{
    local cur=$words[CURRENT] prev=$words[CURRENT-1] at='' word
    local -a found
    for word in ${{words[2,CURRENT-1]}}; do
        case "$at/$word" in
{lead}
        esac
    done
    case "$at/$prev" in
{values}
    esac
    case $at in
{rest}
    esac
}}
if [[ $funcstack[1] == _vedette ]]; then _vedette "$@"; else compdef _vedette vedette; fi
"""
