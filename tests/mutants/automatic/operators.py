"""What is broken in a function, on its syntax tree: signs, axes, powers, squares, wraps, indices, conditions, orders.

`sites(function)` names every place where an operator applies; `mutated(function, site)` is the function with one of them.
Nothing is changed in decorators, annotations, defaults, errors that are raised, f-strings and docstrings.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Iterator
from copy import deepcopy

from attrs import frozen

Node = ast.expr | ast.stmt
Function = ast.FunctionDef

ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARED = {ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
TWINS = dict(
    [pair for one, other in (
        ("sin", "cos"), ("minimum", "maximum"), ("min", "max"), ("any", "all"), ("argmin", "argmax"), ("zeros", "ones"),
        ("sum", "mean"), ("floor", "ceil"), ("log", "log1p"), ("exp", "expm1"), ("cosh", "sinh"), ("hypot", "arctan2"),
    ) for pair in ((one, other), (other, one))]
)  # fmt: skip
DROPPED = {
    "sqrt", "square", "abs", "exp", "log", "canonical", "swapaxes", "clip", "sort", "sorted", "maximum", "minimum", "cumsum",
    "transpose", "nan_to_num", "symmetric", "conj", "copy", "diagonal", "flip",
}  # fmt: skip
"""Calls that are replaced by what they take: the first argument, or for a method with none what it is called on."""

UNLIKE = {"broadcast_to", "full", "reshape", "isinstance", "getattr", "concatenate", "take", "take_along_axis", "evolve"}
"""Calls whose arguments are of unlike kinds: exchanged they only raise."""


@frozen
class Site:
    """An operator at a place of a function: the source `before` and `after`, and which of the equal ones it is."""

    operator: str
    before: str
    after: str
    nth: int = 0


def sites(function: Function) -> list[Site]:
    """Return every site of a function, in the order of its source."""
    seen: Counter[tuple[str, str, str]] = Counter()
    found = []
    for node in _places(function):
        for operator, other in _others(node):
            key = (operator, _said(node), _said(other))
            found.append(Site(*key, seen[key]))
            seen[key] += 1
    return found


def mutated(function: Function, site: Site) -> Function | None:
    """Return a copy of the function with one site changed; None if it has no such site any more."""
    copy = deepcopy(function)
    seen = 0
    for node in _places(copy):
        for operator, other in _others(node):
            if (operator, _said(node), _said(other)) == (site.operator, site.before, site.after):
                if seen == site.nth:
                    swapped = _Swap(node, other).visit(copy)
                    return ast.fix_missing_locations(swapped)
                seen += 1
    return None


class _Swap(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, ast.copy_location(new, old)

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def _said(node: ast.AST) -> str:
    return ast.unparse(node)


def _places(function: Function) -> Iterator[Node]:
    """Return the statements and expressions of a function that may be changed, outermost first."""

    def walk(node: ast.AST) -> Iterator[Node]:
        if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr):
            return
        if isinstance(node, ast.If) and all(isinstance(inner, ast.Raise) for inner in node.body) and not node.orelse:
            return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        if isinstance(node, ast.expr | ast.stmt):
            yield node
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            for inner in node.body if isinstance(node.body, list) else [node.body]:
                yield from walk(inner)
        elif isinstance(node, ast.AnnAssign):
            if node.value is not None:
                yield from walk(node.value)
        else:
            for inner in ast.iter_child_nodes(node):
                yield from walk(inner)

    for statement in function.body:
        yield from walk(statement)


def _others(node: Node) -> Iterator[tuple[str, ast.AST]]:
    """Return what an operator makes of a node, with the operator's name."""
    rule: Callable[[Node], Iterator[tuple[str, ast.AST]]] | None = _RULES.get(type(node))
    if rule is not None:
        yield from rule(node)


def _binary(node: ast.BinOp) -> Iterator[tuple[str, ast.AST]]:
    if isinstance(node.op, ast.Pow):
        if isinstance(node.right, ast.Constant) and isinstance(node.right.value, int | float):
            power = node.right.value
            yield "power", ast.BinOp(node.left, ast.Pow(), ast.Constant(power + 1))
            yield "square", node.left if power == 2 else ast.BinOp(node.left, ast.Pow(), ast.Constant(power - 1))
        return
    if isinstance(node.op, ast.MatMult):
        yield "order", ast.BinOp(node.right, ast.MatMult(), node.left)
        return
    swap = ARITHMETIC.get(type(node.op))
    text = isinstance(node.left, ast.Constant | ast.JoinedStr | ast.Tuple | ast.List) and not _number(node.left)
    if swap is None or text or isinstance(node.right, ast.Tuple | ast.JoinedStr | ast.List):
        return
    yield "sign" if isinstance(node.op, ast.Add | ast.Sub) else "factor", ast.BinOp(node.left, swap(), node.right)
    yield "term", node.left
    if isinstance(node.op, ast.Add | ast.Mult):
        yield "term", node.right


def _number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _unary(node: ast.UnaryOp) -> Iterator[tuple[str, ast.AST]]:
    if isinstance(node.op, ast.USub) and not _number(node.operand):
        yield "sign", node.operand
    elif isinstance(node.op, ast.Not | ast.Invert):
        yield "condition", node.operand


def _compared(node: ast.Compare) -> Iterator[tuple[str, ast.AST]]:
    for i, op in enumerate(node.ops):
        if type(op) in COMPARED:
            ops = [*node.ops[:i], COMPARED[type(op)](), *node.ops[i + 1 :]]
            yield "condition", ast.Compare(node.left, ops, node.comparators)


def _boolean(node: ast.BoolOp) -> Iterator[tuple[str, ast.AST]]:
    yield "condition", ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)


def _chosen(node: ast.IfExp) -> Iterator[tuple[str, ast.AST]]:
    yield "choice", ast.IfExp(node.test, node.orelse, node.body)


def _branched(node: ast.If) -> Iterator[tuple[str, ast.AST]]:
    yield "choice", ast.If(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)


def _constant(node: ast.Constant) -> Iterator[tuple[str, ast.AST]]:
    if type(node.value) is float and node.value not in (0.0,):
        yield "number", ast.Constant(node.value * 2 if abs(node.value) != float("inf") else -node.value)


def _attribute(node: ast.Attribute) -> Iterator[tuple[str, ast.AST]]:
    if node.attr == "T":
        yield "axes", node.value


def _subscript(node: ast.Subscript) -> Iterator[tuple[str, ast.AST]]:
    if not isinstance(node.ctx, ast.Load):
        return
    parts = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
    for i, part in enumerate(parts):
        value = _whole(part)
        if value is not None:
            other: ast.expr = ast.Constant({0: 1, 1: 0, -1: 0}.get(value, value - 1))
        elif isinstance(part, ast.Slice) and part.lower is not None and part.upper is None and _whole(part.lower) == 1:
            other = ast.Slice(None, None, part.step)
        else:
            continue
        changed = [*parts[:i], other, *parts[i + 1 :]]
        index = ast.Tuple(changed, ast.Load()) if isinstance(node.slice, ast.Tuple) else changed[0]
        yield "index", ast.Subscript(node.value, index, ast.Load())


def _whole(node: ast.AST) -> int | None:
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return node.value
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
        return -node.operand.value if type(node.operand.value) is int else None
    return None


def _call(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name in TWINS:
        twin = (
            ast.Attribute(node.func.value, TWINS[name], ast.Load())
            if isinstance(node.func, ast.Attribute)
            else ast.Name(TWINS[name], ast.Load())
        )
        yield "twin", ast.Call(twin, node.args, node.keywords)
    if name in DROPPED:
        if node.args:
            yield "wrap", node.args[0]
        elif isinstance(node.func, ast.Attribute):
            yield "wrap", node.func.value
    if name == "difference" and len(node.args) == 2:
        yield "wrap", ast.BinOp(node.args[0], ast.Sub(), node.args[1])
    if name == "displace" and len(node.args) == 2:
        yield "wrap", ast.BinOp(node.args[0], ast.Add(), node.args[1])
    if name == "where" and len(node.args) == 3:
        yield "choice", ast.Call(node.func, [node.args[0], node.args[2], node.args[1]], node.keywords)
    elif len(node.args) >= 2 and name[:1].islower() and name not in UNLIKE:
        unlike = ast.Constant | ast.JoinedStr | ast.Starred | ast.Tuple
        if not any(isinstance(argument, unlike) for argument in node.args[:2]):
            yield "order", ast.Call(node.func, [node.args[1], node.args[0], *node.args[2:]], node.keywords)
    for i, keyword in enumerate(node.keywords):
        value = _whole(keyword.value)
        if keyword.arg == "axis" and value is not None:
            other = ast.keyword("axis", ast.Constant({-1: -2, -2: -1, 0: -1, 1: 0}.get(value, value + 1)))
            yield "axes", ast.Call(node.func, node.args, [*node.keywords[:i], other, *node.keywords[i + 1 :]])


def _stated(node: ast.Assign | ast.AugAssign) -> Iterator[tuple[str, ast.AST]]:
    if isinstance(node, ast.AugAssign):
        swap = ARITHMETIC.get(type(node.op))
        if swap is not None:
            yield "sign", ast.AugAssign(node.target, swap(), node.value)
        yield "statement", ast.Pass()
    elif isinstance(node.targets[0], ast.Subscript):
        yield "statement", ast.Pass()


_RULES: dict[type, Callable[..., Iterator[tuple[str, ast.AST]]]] = {
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.Compare: _compared,
    ast.BoolOp: _boolean,
    ast.IfExp: _chosen,
    ast.If: _branched,
    ast.Constant: _constant,
    ast.Attribute: _attribute,
    ast.Subscript: _subscript,
    ast.Call: _call,
    ast.Assign: _stated,
    ast.AugAssign: _stated,
}
