"""The messages of our errors, read from the source: their templates and their codes.

`python -m tests.errors` lists raises without a code; with `--write` it writes the
golden file of all templates.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache

from tests.sources import ROOT, below, trees, uncollected

GOLDEN = ROOT / "tests" / "golden" / "errors.txt"
CODE = re.compile(r"\(R(\d{4})\)")
#: file:function whose errors get their code in another place -> that place. Such an
#: error is a piece of a longer sentence, or the sentence of another program.
ELSEWHERE = {
    "rems_net/agents/experiment/solo.py:close": "the agent's own error",
    "rems_net/agents/verbs.py:outcome": "the program that has the verb",
    "rems_net/client/client.py:ask": "the program that refuses",
    "rems_net/client/client.py:hear": "counted in Client._tell_dropped",
    "rems_net/client/driving.py:open": "the robot that refuses",
    **dict.fromkeys(
        (
            "rems_net/drivers/hardware/create2/open_interface.py:exchange",
            "rems_net/drivers/hardware/create2/open_interface.py:_newest",
            "rems_net/drivers/hardware/create2/open_interface.py:_readings",
            "rems_net/drivers/hardware/dynamixel/bus.py:_answer",
            "rems_net/drivers/hardware/dynamixel/bus.py:_check",
            "rems_net/drivers/hardware/dynamixel/bus.py:_damaged",
            "rems_net/drivers/hardware/dynamixel/servos.py:_look_after",
        ),
        "counted in DeviceThread._reject",
    ),
    "rems_net/router/session.py:ask": "the program that refuses",
}
#: functions that return a text with all of what they are given
ADDS = ("join", "str", "next", "longer", "placed")
Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Module


@cache
def modules() -> dict[str, ast.Module]:
    found = trees().items()
    return {path.relative_to(ROOT).as_posix(): tree for path, tree in found}


@cache
def nodes() -> list[tuple[str, ast.AST, Function]]:
    """Return what the tests look at: its file, itself and the function around it."""
    found: list[tuple[str, ast.AST, Function]] = []
    for file, tree in modules().items():
        left: list[tuple[ast.AST, Function]] = [(tree, tree)]
        while left:
            node, inside = left.pop()
            if isinstance(node, ast.Raise | ast.ClassDef | ast.FunctionDef):
                found.append((file, node, inside))
            if isinstance(node, Function):
                inside = node
            left += [(child, inside) for child in below(node)]
    return found


@cache
def errors() -> set[str]:
    """Return the names of RemsError and of all classes below it."""
    bases = [
        (node.name, {last(base) for base in node.bases})
        for _, node, _ in nodes()
        if isinstance(node, ast.ClassDef)
    ]
    known = {"RemsError"}
    while more := {name for name, of in bases if of & known} - known:
        known |= more
    return known


@cache
def functions() -> dict[str, list[tuple[str, Function]]]:
    """Return the functions of the package by name, each with its file."""
    found: defaultdict[str, list[tuple[str, Function]]] = defaultdict(list)
    for file, node, _ in nodes():
        if isinstance(node, ast.FunctionDef):
            found[node.name].append((file, node))
    return found


def last(node: ast.expr) -> str:
    """Return the last word of a name: `c` for `a.b.c`, "" for anything else."""
    if isinstance(node, ast.Subscript):
        return last(node.value)
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def bare() -> list[tuple[str, int, str]]:
    """Return each raise without a code in its own place: file, line and function."""
    return [
        (file, node.lineno, getattr(inside, "name", ""))
        for file, node, inside in nodes()
        if isinstance(node, ast.Raise)
        and isinstance(node.exc, ast.Call)
        and is_ours(file, node.exc)
        and not coded(file, inside, node.exc, 3)
    ]


def is_ours(file: str, call: ast.Call) -> bool:
    """Return whether it is an error of ours, or a function that returns one."""
    name = last(call.func)
    returns = [
        last(f.returns)
        for _, f in nearby(file, name)
        if isinstance(f, ast.FunctionDef) and f.returns is not None
    ]
    return name in errors() or bool({*returns} & errors())


def nearby(file: str, name: str) -> list[tuple[str, Function]]:
    known = functions().get(name, [])
    return [one for one in known if one[0] == file] or known


def coded(file: str, where: Function, made: ast.expr, deep: int) -> bool:
    """Return whether a code is in an expression, or in what its parts are made of."""
    parts = [*whole(made, outermost=True)]
    names = {node.id for node in parts if isinstance(node, ast.Name)}
    pasted = [
        node.value
        for part in parts
        if isinstance(part, ast.JoinedStr)
        for node in part.values
        if isinstance(node, ast.FormattedValue)
    ]
    inner = {last(cause_of(node)) for node in pasted}
    return (
        any(isinstance(one, ast.Constant) and has_code(one.value) for one in parts)
        or bool((names | inner) & (caught(where) | constants()))
        or (
            deep > 0
            and (
                any(
                    makes(file, last(c.func), deep)
                    for c in (*parts, *pasted)
                    if isinstance(c, ast.Call)
                )
                or any(
                    coded(file, where, value, deep - 1)
                    for name, value in assigned(where)
                    if name in names | inner
                )
            )
        )
    )


def cause_of(node: ast.expr) -> ast.expr:
    """Return `error` for `error.cause`, which ends in the code of the error."""
    whole = isinstance(node, ast.Attribute) and node.attr == "cause"
    return node.value if isinstance(node, ast.Attribute) and whole else node


@cache
def constants() -> set[str]:
    """Return the names of constants that hold a message with its code."""
    return {
        last(node.targets[0])
        for tree in modules().values()
        for node in tree.body
        if isinstance(node, ast.Assign) and CODE.search(ast.unparse(node.value))
    }


def has_code(text: object) -> bool:
    return isinstance(text, str) and bool(CODE.search(text))


def whole(node: ast.AST, *, outermost: bool = False) -> Iterator[ast.AST]:
    """Yield what gives a text itself, and not only a word of it."""
    yield node
    for child in ast.iter_child_nodes(node):
        word = isinstance(node, ast.Call) and child is not node.func
        adds = isinstance(node, ast.Call) and last(node.func) in ADDS
        if not isinstance(child, ast.FormattedValue) and (
            outermost or adds or not word
        ):
            yield from whole(child)


@cache
def makes(file: str, name: str, deep: int) -> bool:
    """Return whether a function of this name makes a text with a code."""
    return any(
        coded(home, function, part, deep - 1)
        for home, function in nearby(file, name)
        if isinstance(function, ast.FunctionDef) and gives_text(function)
        for part in pieces(function)
    )


def gives_text(function: ast.FunctionDef) -> bool:
    """Return whether it returns a message, or an error that has one."""
    returns = ast.unparse(function.returns) if function.returns else ""
    return bool({*re.findall(r"\w+", returns)} & {"str", *errors()})


@cache
def assigned(where: Function) -> list[tuple[str, ast.expr]]:
    """Return the names that are assigned in a function, with their values."""
    found = []
    for node in ast.walk(where):
        if isinstance(node, ast.Assign):
            found += [(last(target), node.value) for target in node.targets]
        elif isinstance(node, ast.AnnAssign | ast.AugAssign) and node.value:
            found.append((last(node.target), node.value))
        elif isinstance(node, ast.For):
            found.append((last(node.target), node.iter))
        elif isinstance(node, ast.Call) and last(node.func) == "append":
            found.append((last(node.func.value), node.args[0]))  # type: ignore[attr-defined]
    return found


@cache
def caught(where: Function) -> set[str]:
    """Return the names of caught errors that are always ours: they have a code."""
    return {
        node.name
        for node in ast.walk(where)
        if isinstance(node, ast.ExceptHandler)
        and node.name
        and node.type is not None
        and {*map(last, kinds(node.type))} <= errors()
    }


def kinds(given: ast.expr) -> list[ast.expr]:
    return given.elts if isinstance(given, ast.Tuple) else [given]


@cache
def pieces(function: Function) -> list[ast.expr]:
    """Return what a function returns or yields; not what it raises."""
    return [
        node.value
        for node in ast.walk(function)
        if isinstance(node, ast.Return | ast.Yield) and node.value is not None
    ]


def templates() -> dict[str, list[str]]:
    """Return the templates of the messages by code, in source order."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for tree in modules().values():
        left: list[ast.AST] = [tree]
        texts: list[tuple[int, str]] = []
        while left:  # from the outside in
            node = left.pop()
            if not isinstance(node, ast.BinOp | ast.JoinedStr | ast.Constant):
                left += ast.iter_child_nodes(node)
                continue
            if isinstance(node, ast.Constant) and not isinstance(node.value, str):
                continue
            text = shown(node)
            if CODE.search(text):
                texts.append((node.lineno, text.replace("\n", "\\n")))
        for _, text in sorted(texts):
            code = f"R{CODE.findall(text)[-1]}"
            found[code].append(text.replace(f" ({code})", ""))
    return dict(sorted(found.items()))


def shown(node: ast.AST) -> str:
    """Return an expression as a reader of the message would see it."""
    match node:
        case ast.JoinedStr():
            return "".join(
                str(v.value) if isinstance(v, ast.Constant) else f"{{{shown(v)}}}"
                for v in node.values
            )
        case ast.FormattedValue():
            return shown(node.value)
        case ast.Constant():
            return str(node.value)
        case ast.BinOp(op=ast.Add()):
            return shown(node.left) + shown(node.right)
        case ast.IfExp():
            return f"{shown(node.body)}|{shown(node.orelse)}"
        case ast.BoolOp():
            return "|".join(map(shown, node.values))
        case ast.Call():
            name = last(node.func)
            if name in ("join", "map", "repr", "str", "some", "sorted") and node.args:
                return shown(node.args[-1])
            return name or ast.unparse(node)
        case ast.Attribute() | ast.Name() | ast.Subscript():
            return last(node) or ast.unparse(node)
    return ast.unparse(node)


def read() -> tuple[list[tuple[str, int, str]], dict[str, list[str]]]:
    """Return the raises without a code, and the templates; keep none of the trees."""
    with uncollected():
        found = bare(), templates()
        for cached in (modules, nodes, errors, functions, constants):
            cached.cache_clear()
        for kept in (makes, assigned, caught, pieces):
            kept.cache_clear()
    return found


def uncoded(found: list[tuple[str, int, str]]) -> list[str]:
    """Return the places of those raises that get no code from elsewhere."""
    return [
        f"{file}:{line}"
        for file, line, function in found
        if f"{file}:{function}" not in ELSEWHERE
    ]


def golden(found: dict[str, list[str]]) -> str:
    """Return the golden file: each code with its messages."""
    return "\n".join(
        "\n  ".join([code, *texts]) + "\n" for code, texts in found.items()
    )


def main() -> None:
    raises, messages = read()
    if "--write" in sys.argv:
        GOLDEN.write_text(golden(messages), encoding="utf-8")
    without = uncoded(raises)
    print(*without, f"{len(without)} raises without a code", sep="\n")


if __name__ == "__main__":
    main()
