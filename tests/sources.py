"""The package's modules as trees, read once for all tests that look at them."""

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent


@cache
def trees() -> dict[Path, ast.Module]:
    """Return the tree of each module.

    They are millions of nodes that stay, and no garbage collection looks at them: these
    would take longer than the reading.
    """
    gc.collect()
    gc.disable()
    try:
        found = {
            path: ast.parse(path.read_text(encoding="utf-8"))
            for path in sorted((ROOT / "rems_net").rglob("*.py"))
        }
    finally:
        gc.enable()
    gc.freeze()
    return found


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
