"""Words: what is written in the elements of a URDF, and sentences about it."""

from xml.etree.ElementTree import Element

from rems_net.errors import SchemaError
from rems_net.kinematics.pose import Pose

#: What is beyond can't be computed with: its square times a mass is no float.
MOST = 1e50


class Words:
    """Reads numbers out of a file of this name, or says which one is none."""

    def __init__(self, name: str):
        self._name = name

    def error(self, what: str) -> SchemaError:
        """Return the error for the file."""
        return SchemaError(f"{self._name}: {what}.")

    def number(self, element: Element, tag: str, key: str) -> float:
        """Return one number of an element in this one; 0 where there is none."""
        return self.numbers(element.find(tag), key, "0")[0]

    def numbers(self, element: Element | None, key: str, default: str) -> list[float]:
        """Return the numbers of an attribute; the default where it is left out."""
        if element is None:
            element = Element("")
        return self.read(element.tag, key, element.get(key, default), default)

    def read(self, tag: str, key: str, text: str, example: str) -> list[float]:
        """Return as many numbers as there are in the example, none beyond MOST."""
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
