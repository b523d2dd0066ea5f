"""Links: those of a URDF, and the joints that each of them carries, as one tree."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from rems_net.drivers.models.words import Words
from rems_net.errors import some


class Links:
    """The tree of a robot's links. Raises SchemaError where they make none.

    named: each link      children: the joints on it      root: the one on no joint
    """

    def __init__(self, words: Words, robot: Element):
        for kind in ("link", "joint"):
            names = [name_of(one) for one in robot.findall(kind)]
            if "" in names:
                raise words.error(f"one of its {kind}s has no name")
            if len({*names}) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise words.error(f"two of its {kind}s are called {twice!r}")
        self.named = {name_of(link): link for link in robot.findall("link")}
        self.children: dict[str, list[Element]] = {name: [] for name in self.named}
        carried = set[str]()
        for joint in robot.findall("joint"):
            parent, child = end_of(joint, "parent"), end_of(joint, "child")
            for end in (parent, child):
                if end not in self.named:
                    raise words.error(
                        f"joint {name_of(joint)!r} joins the link {end!r}, which it "
                        "does not have"
                    )
            if child in carried:
                raise words.error(f"two joints carry the link {child!r}")
            carried.add(child)
            self.children[parent].append(joint)
        roots = [name for name in self.named if name not in carried]
        if len(roots) != 1:
            raise words.error(
                "a robot has one link that no joint carries, and this has "
                f"{len(roots)} ({some(roots)})"
            )
        (self.root,) = roots
        if lost := self.named.keys() - {*self._on(self.root)}:
            raise words.error(
                f"its links {some(sorted(lost))} carry one another in a circle"
            )

    def rename(self, old: str, new: str) -> None:
        """Give a link another name."""
        self.named[new], self.children[new] = self.named[old], self.children[old]

    def _on(self, name: str) -> Iterator[str]:
        yield name
        for joint in self.children[name]:
            yield from self._on(end_of(joint, "child"))


def name_of(element: Element) -> str:
    """Return its name; "" without one."""
    return str(element.get("name", ""))


def end_of(joint: Element, which: str) -> str:
    """Return the link that is the joint's "parent" or "child"."""
    found = joint.find(which)
    return "" if found is None else str(found.get("link", ""))
