"""Elements: reads numbers and the tree of links from the elements of a URDF."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from rems_net.errors import SchemaError, some
from rems_net.kinematics.pose import Pose

#: Larger numbers can't be used: their square times a mass is no float.
MOST = 1e50


class Words:
    """Reader of numbers in a file of this name; its errors name the attribute."""

    def __init__(self, name: str):
        self._name = name

    def error(self, what: str) -> SchemaError:
        """Return the error for the file."""
        return SchemaError(f"{self._name}: {what}. (R0205)")

    def number(self, element: Element, tag: str, key: str) -> float:
        """Return one number of a child element; 0 if it is missing."""
        return self.numbers(element.find(tag), key, "0")[0]

    def numbers(self, element: Element | None, key: str, default: str) -> list[float]:
        """Return the numbers of an attribute; the default if it is missing."""
        if element is None:
            element = Element("")
        return self.read(element.tag, key, element.get(key, default), default)

    def read(self, tag: str, key: str, text: str, example: str) -> list[float]:
        """Return as many numbers as the example has, none larger than MOST."""
        try:
            found = [float(one) for one in text.split()]
        except ValueError:
            found = []
        if len(found) != len(example.split()) or not all(
            abs(one) <= MOST for one in found
        ):
            raise self.error(
                f'<{tag}> has {key}="{text}"; expected numbers as in {key}="{example}"'
            )
        return found

    def pose(self, element: Element) -> Pose:
        """Return the pose of the element's origin."""
        origin = element.find("origin")
        roll, pitch, yaw = self.numbers(origin, "rpy", "0 0 0")
        at = self.numbers(origin, "xyz", "0 0 0")
        return Pose.of(at, roll=roll, pitch=pitch, yaw=yaw)


class Links:
    """The tree of a robot's links. Raises SchemaError if they make no tree.

    named: links by name      children: joints on each      root: link without a joint
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
    """Return an element's name; "" without one."""
    return str(element.get("name", ""))


def end_of(joint: Element, which: str) -> str:
    """Return the link that is the joint's "parent" or "child"."""
    found = joint.find(which)
    return "" if found is None else str(found.get("link", ""))
