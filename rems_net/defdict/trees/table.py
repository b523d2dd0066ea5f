"""The table of a tree for people."""

from collections.abc import Sequence

from rems_net.defdict.trees.tree import Tree


def table(tree: Tree) -> str:
    """Return one line a field: type, unit, range, default, doc."""
    rows = [("field", "type", "unit", "range", "default", "")]
    for path, field in tree.rows():
        limits = f"{field.range[0]:g} to {field.range[1]:g}" if field.range else ""
        default = "" if field.shape or field.dtype == "list" else f"{field.default!r}"
        doc = field.doc if field.doc.isprintable() else repr(field.doc)[1:-1]
        row = (path, field.describe_type(), field.unit, limits, default, doc)
        rows.append(row)
    return f"{tree.name}@{tree.digest}\n{columns(rows)}"


def columns(rows: Sequence[tuple[str, ...]]) -> str:
    """Return rows as aligned columns."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
