"""The ROS 2 message definition of a schema, with units and ranges as comments.

Names of ROS fields are small letters, digits and single underscores, and begin with a
letter; `joint/1`, `Left` and `grün` are brought to that. The way back needs no names:
the schema itself is recorded beside, and its fields are in the same order.
"""

import keyword
import re
from collections.abc import Iterable

from rems_net.defdict.fields.descriptions import in_brief
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.wire.cdr import canonical

#: the package whose messages these are
PACKAGE = "rems_msgs"
#: what stands between two definitions of one text
_LINE = "=" * 80
_KINDS = {"float": "float64", "int": "int64", "bool": "bool", "bytes": "uint8[]"}
_KINDS |= {"str": "string", "choice": "string", "f8": "float64", "f4": "float32"}
_KINDS |= {f"{c}{n}": f"{word}{8 * n}" for c, word in (("i", "int"), ("u", "uint"))
           for n in (1, 2, 4, 8)}  # fmt: skip
#: what a message without fields has, in ROS 2
_EMPTY = "uint8 structure_needs_at_least_one_member"
#: names that a ROS field cannot have beside those of Python: base types of ROS
_TAKEN = {"float32", "float64", "string", "wstring", "time", "duration", "byte", "char"}


def type_name(port: str, tree: Tree) -> str:
    """Return the name of the type of a port: `rems_msgs/msg/State6b1f...`."""
    return f"{PACKAGE}/msg/{_camel(port)}{tree.digest}"


def ros2msg(port: str, tree: Tree) -> str:
    """Return the definition of that type, and of all that it is made of."""
    texts: list[str] = []
    _define(canonical(tree), type_name(port, tree).rpartition("/")[2], texts, set())
    return f"\n{_LINE}\n".join(texts)


def members(names: Iterable[str]) -> dict[str, str]:
    """Return the ROS name of each of the names in one group, all different."""
    made: dict[str, str] = {}
    for name in names:
        plain = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")
        if not plain or plain[0].isdigit():
            plain = f"n{plain}"
        if keyword.iskeyword(plain) or plain in _TAKEN:
            plain = f"{plain}_value"
        count, free = 2, plain
        while free in made.values():
            free, count = f"{plain}_{count}", count + 1
        made[name] = free
    return made


def _define(tree: Tree, name: str, texts: list[str], used: set[str]) -> None:
    """Add the definition of a message, and behind it those of its groups.

    used: names of the groups, which are all different.
    """
    head = f"MSG: {PACKAGE}/{name}\n" if texts else ""
    place = len(texts)
    texts.append("")
    lines = []
    for key, plain in members(tree.entries).items():
        entry = tree.entries[key]
        note = [] if plain == key else [f"{key!r}"]
        inner = entry if isinstance(entry, Tree) else entry.item
        if inner is not None:
            own = f"{name}{_camel(plain)}"
            while own in used:
                own += "X"
            used.add(own)
            _define(inner, own, texts, used)
            kind = f"{PACKAGE}/{own}{'' if isinstance(entry, Tree) else '[]'}"
        elif isinstance(entry, Field):
            kind = _kind(entry)
            note += _note(entry)
        lines.append(f"{kind} {plain}  # {' '.join(note)}".removesuffix("  # "))
    texts[place] = head + "\n".join(lines or [_EMPTY])


def _kind(one: Field) -> str:
    kind = _KINDS[one.dtype]
    return f"{kind}[{one.size}]" if one.shape else kind


def _note(one: Field) -> list[str]:
    """Return unit, shape and range of a field, or its choices, if it has any."""
    if one.choices:
        return [f"one of {', '.join(one.choices)}"]
    special = one.unit or one.range or len(one.shape) > 1
    return [in_brief(one)] if special else []


def _camel(name: str) -> str:
    words = re.sub("[^A-Za-z0-9]+", " ", name).split()
    return "".join(word[0].upper() + word[1:] for word in words)
