"""Trees from trees: merged, renamed, prefixed, cut; each gives path to field."""

from collections.abc import Iterable, Mapping
from typing import Any

from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.words import definition
from rems_net.defdict.trees.paths import matching
from rems_net.defdict.trees.tree import Tree
from rems_net.errors import SchemaError

Fields = dict[str, Field]


def merge(parts: Iterable[tuple[Tree, str]]) -> Fields:
    """Merge trees, each given with its origin; raise SchemaError on a clash."""
    merged: dict[str, Field] = {}
    origins: dict[str, str] = {}
    for tree, origin in parts:
        for path, field in tree.rows():
            _check_nesting(path, origin, merged, origins)
            if path in merged and merged[path].meaning != field.meaning:
                raise SchemaError(
                    f"{path!r} is defined twice: {definition(merged[path])} by "
                    f"{origins[path]}, and {definition(field)} by {origin}. "
                    f"Rename one of them, or give one a prefix."
                )
            if path not in merged:
                merged[path], origins[path] = field, origin
    return merged


def _check_nesting(
    path: str, origin: str, merged: Mapping[str, Field], origins: Mapping[str, str]
) -> None:
    for other in merged:
        short, long = sorted((path, other), key=len)
        if long.startswith(f"{short}/"):
            whose, its = (origin, origins[other])
            group, field = (whose, its) if short == other else (its, whose)
            raise SchemaError(
                f"{short!r} is a field in {field}, but a group in {group} "
                f"({long!r}). Rename one of them."
            )


def rename(tree: Tree, new: Mapping[str, str]) -> Fields:
    """Rename fields or groups: {"wheel/left": "motor/1"}; the order stays."""
    for old in new:
        tree[old]
    made: dict[str, Field] = {}
    for path, field in tree.rows():
        moved = _moved(path, new)
        if moved in made:
            raise SchemaError(f"{tree.name}: two fields would be named {moved!r}.")
        made[moved] = field
    return made


def _moved(path: str, new: Mapping[str, str]) -> str:
    chunks = path.split("/")
    for end in range(len(chunks), 0, -1):
        head = "/".join(chunks[:end])
        if head in new:
            return "/".join([new[head], *chunks[end:]])
    return path


def prefix(tree: Tree, group: str) -> Fields:
    """Put all fields into a group: "arm" makes "joint/1" "arm/joint/1"."""
    return {f"{group}/{path}": field for path, field in tree.rows()}


def cut(tree: Tree, selections: tuple[str, ...]) -> Fields:
    """Keep the fields that any of the paths, groups or globs selects."""
    keep: set[str] = set()
    for selection in selections:
        found: Any = matching(selection, tree.paths)
        if not found and "*" not in selection:
            found = matching(f"{selection}/**", tree.paths)
        if not found:
            raise tree.unknown(selection)
        keep.update(found)
    return {path: field for path, field in tree.rows() if path in keep}
