"""Walks plain data and an attrs class together, builds the object, and collects every problem with its path."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import attrs
from attrs import field, frozen

from vedette.config.contract import Installed
from vedette.config.parameters import (
    Many,
    Maybe,
    Names,
    Parameter,
    Part,
    Shape,
    Table,
    holds_parts,
    in_words,
    parameters,
    words_of,
)
from vedette.config.registry import Registry, choice_of
from vedette.config.suggestions import did_you_mean, nearest
from vedette.errors import ConfigError, Problem, VedetteError
from vedette.tracking.components import below
from vedette.tracking.faults import raised_by

T = TypeVar("T")

LONGEST = 400
"""Greatest length of a message in characters; a matrix quoted whole may be longer."""


class _Failed:
    """Stands for a value that could not be built: its problem is already reported."""


FAILED = _Failed()


def told(given: Any) -> str:
    """Describe what was given in a few words."""
    if given is None:
        return "nothing"
    if isinstance(given, Mapping):
        return "a table"
    if isinstance(given, list | tuple):
        return f"a list of {len(given)}"
    if isinstance(given, bool | int | float | str):
        return repr(given)
    return f"a {type(given).__name__}"


@frozen
class Builder:
    """One walk: what is installed, and the problems found so far."""

    registry: Registry
    problems: list[Problem] = field(factory=list, init=False)

    def fail(self, place: str, text: str) -> _Failed:
        """Record a problem."""
        short = text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
        self.problems.append(Problem(place, short))
        return FAILED

    def check_names(self, given: Mapping[str, Any], known: Iterable[str], place: str, what: str) -> set[str]:
        """Record every unknown name. Return the known names that they were probably meant to be."""
        known = list(known)
        absent = [name for name in known if name not in given]
        meant = set()
        for name in given:
            if not isinstance(name, str):
                self.fail(place, f"names must be strings, got {name!r}")
            elif name not in known:
                meant.add(nearest(name, absent) or "")
                question = did_you_mean(name, absent) or did_you_mean(name, known)
                self.fail(below(place, name), f"unknown;{question} {what} takes {', '.join(known)}")
        return meant

    def construct(
        self, cls: type[T], declared: Iterable[Parameter], given: Mapping[str, Any], place: str, meant: set[str]
    ) -> T | _Failed:
        """Build a class from what `given` says about its parameters, without complaint about missing ones in `meant`."""
        declared = list(declared)
        stated, before = [p for p in declared if p.name in given], len(self.problems)
        values = {p.name: self._shaped(p.shape, given[p.name], below(place, p.name)) for p in stated}
        for parameter in declared:
            if parameter.required and parameter not in stated:
                values[parameter.name] = FAILED
                if parameter.name not in meant:
                    self.fail(below(place, parameter.name), f"missing: {parameter.meaning}".rstrip(": "))
        complaints: list[str] = []
        if not any(value is FAILED for value in values.values()):
            try:
                return cls(**values)
            except ConfigError as error:
                complaints = [str(problem) for problem in error.problems]
            except (ValueError, TypeError, ArithmeticError, VedetteError) as error:
                complaints = [str(error)]
            except Exception as error:
                if (text := raised_by(error, None)) is None:
                    raise
                complaints = [text]
        walked = len(self.problems)
        for parameter in stated:
            if not holds_parts(parameter.shape):
                self._judge(parameter, values[parameter.name], below(place, parameter.name))
        names = {parameter.field.name: parameter.name for parameter in declared}
        for complaint in complaints if len(self.problems) == walked else ():
            self._complain(complaint, place, names)
        self._sort(before, [below(place, parameter.name) for parameter in declared])
        return FAILED

    def _sort(self, since: int, places: list[str]) -> None:
        """Sort the latest problems by a class's parameters; those of one parameter keep their order."""

        def order(problem: Problem) -> int:
            owners = [i for i, place in enumerate(places) if re.match(rf"{re.escape(place)}($|[.\[])", problem.place)]
            return owners[0] if owners else len(places)

        self.problems[since:] = sorted(self.problems[since:], key=order)

    def _complain(self, text: str, place: str, names: Mapping[str, str]) -> None:
        """Record a class's own complaint: `name: ...` or `name.part[0]: ...` about a parameter, else about all of it."""
        about = re.match(r"(\w+)((?:\.[\w-]+|\[\d+\])*): ", text)
        if about and about[1] in names:
            self.fail(below(place, names[about[1]]) + about[2], text[about.end() :])
        else:
            self.fail(place, text)

    def _judge(self, parameter: Parameter, given: Any, place: str) -> None:
        """Record what is wrong with one value of a class that could not be built: its constructor reports only the first."""
        name = parameter.field.name
        try:
            value = _converted(parameter.field, given)
            if parameter.field.validator is not None:
                parameter.field.validator(None, parameter.field, value)
        except AttributeError:
            return  # a validator that reads other parameters: what it says is the constructor's complaint
        except (ValueError, TypeError, ArithmeticError) as error:
            self._reject(str(error).removeprefix(f"{name}: "), given, place)

    def _reject(self, text: str, given: Any, place: str) -> _Failed:
        """Record a leaf's problem; if it is about one name of a table, at that name."""
        name, colon, rest = text.partition(": ")
        if colon and isinstance(given, Mapping) and name in given:
            return self.fail(below(place, name), rest)
        return self.fail(place, text)

    def _shaped(self, shape: Shape, given: Any, place: str) -> Any:
        """Return given components, built; any other value as it is: the constructor converts it once."""
        if given is FAILED or not holds_parts(shape):
            return given
        match shape:
            case Maybe(item):
                return None if given is None else self._shaped(item, given, place)
            case Part():
                return self._part(shape, given, place)
            case Table(cls):
                return self._table(cls, given, place)
            case Many(item):
                if not isinstance(given, list | tuple):
                    return self.fail(place, f"must be a {in_words(shape)}, got {told(given)}")
                items = [self._shaped(item, value, below(place, i)) for i, value in enumerate(given)]
                return FAILED if any(item is FAILED for item in items) else tuple(items)
            case Names(item):
                if not isinstance(given, Mapping):
                    return self.fail(place, f"must be a table of {in_words(shape)}, got {told(given)}")
                self.check_names(given, (name for name in given if isinstance(name, str)), place, "it")
                named = {str(name): self._shaped(item, value, below(place, str(name))) for name, value in given.items()}
                return FAILED if any(value is FAILED for value in named.values()) else named

    def _table(self, cls: type, given: Any, place: str) -> Any:
        if isinstance(given, cls):
            return given
        declared, words = parameters(cls), words_of(cls)
        known = [parameter.name for parameter in declared]
        if isinstance(given, str) and given in words:
            given = words[given]
        if not isinstance(given, Mapping):
            called = f"; or {' or '.join(map(repr, words))}" if words else ""
            return self.fail(place, f"must be a table of {', '.join(known)}, got {told(given)}{called}")
        return self.construct(cls, declared, given, place, self.check_names(given, known, place, cls.__name__))

    def _part(self, shape: Part, given: Any, place: str) -> Any:
        if isinstance(given, shape.base):
            return given
        candidates = [entry for entry in self.registry.of_role(shape.role) if issubclass(entry.cls, shape.base)]
        if not isinstance(given, Mapping):
            known = isinstance(given, str) and given in [entry.kind for entry in candidates]
            named = f", as {{ kind = {given!r} }}" if known else ""
            return self.fail(
                place, f"must be a table that names its kind{named}, got {told(given)}; {choice_of(candidates)}"
            )
        at_kind = below(place, "kind")
        if "kind" not in given:
            typo = nearest("kind", [name for name in given if isinstance(name, str)])
            if typo is not None:
                return self.fail(below(place, typo), "unknown; did you mean 'kind'?")
            return self.fail(at_kind, f"missing; {choice_of(candidates)}")
        kind = given["kind"]
        if not isinstance(kind, str):
            return self.fail(at_kind, f"must be the name of a kind, got {told(kind)}; {choice_of(candidates)}")
        entry = next((entry for entry in candidates if entry.kind == kind), None)
        if entry is None:
            self.problems.append(Problem(at_kind, self._why_not(shape, kind, candidates)))  # never cut: it holds the cause
            return FAILED
        names = ["kind", *(parameter.name for parameter in entry.parameters)]
        meant = self.check_names(given, names, place, repr(kind))
        return self.construct(entry.cls, entry.parameters, given, place, meant)

    def _why_not(self, shape: Part, kind: str, candidates: list[Installed]) -> str:
        """Return why a kind cannot be used here: it is not installed, or not of the narrower base that is needed."""
        if self.registry.find(shape.role, kind) is None:
            return self.registry.unknown(shape.role, kind, candidates)
        return f"must be a {shape.base.__name__}, and {kind!r} is none; {choice_of(candidates)}"


def _converted(attribute: attrs.Attribute[Any], given: Any) -> Any:
    """Return a value converted by the field's converter."""
    convert: Any = attribute.converter
    if convert is None:
        return given
    takes_more = isinstance(convert, attrs.Converter)
    return convert(given, None, attribute) if takes_more else convert(given)
