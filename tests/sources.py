"""The package's modules as trees, for the tests that look at them."""

import ast
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parent.parent


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage in the block.

    A million nodes are read, and each collection would look at all of them. Do not
    keep them for longer: later collections look at them, too.
    """
    collects = gc.isenabled()  # not in a block inside another one
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def trees() -> dict[Path, ast.Module]:
    """Return the tree of each module."""
    with uncollected():
        return {
            path: ast.parse(path.read_text(encoding="utf-8"))
            for path in sorted((ROOT / "rems_net").rglob("*.py"))
        }


def below(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the children of a node that may hold a statement: no expression does."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield child


def outside_expressions(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and all below it, but no expressions."""
    left = [tree]
    while left:
        node = left.pop()
        yield node
        left += below(node)
