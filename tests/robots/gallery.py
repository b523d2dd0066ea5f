"""The robots of docs/robots.md: `python -m tests.robots.gallery`.

The pictures are kept with the page; the texts are tested.
"""

import inspect
import sys
from collections.abc import Iterator

from rems_net.agents import registry
from rems_net.agents.parts import by_name
from rems_net.agents.robot import Definition
from rems_net.bodies.body import Embodied
from rems_net.bodies.noise import Noise
from rems_net.cli.part import about
from rems_net.drivers.noise import Noised
from tests.commands import ROOT
from tests.robots.drawing import draw

PAGE = ROOT / "docs" / "robots.md"
PICTURES = ROOT / "docs" / "robots"
BEGIN, END = "<!-- python -m tests.robots.gallery -->", "<!-- end -->"


def names() -> list[str]:
    """The built-in robots that have a body."""
    every = [made(n) for n in registry.BUILT_IN["definition"]]
    return [one.name for one in every if isinstance(one, Embodied) and one.obeys]


def made(name: str) -> Definition:
    """A robot of that name, without a driver."""
    (part,) = by_name("definition")[name]
    cls = part.load()
    assert issubclass(cls, Definition)
    return cls(name)


def rows() -> Iterator[str]:
    """The lines of the page, from the definitions themselves."""
    yield "| name | picture | what it is |\n|---|---|---|"
    for name in names():
        (part,) = by_name("definition")[name]
        first = " ".join(about(part)["doc"].partition("\n\n")[0].split())
        yield f"| `{name}` | ![{name}](robots/{name}.png) | {first} |"
    yield "\nTheir noise, on request, in the units of the fields:\n"
    yield "| robot | standard deviation, steps |\n|---|---|"
    for name in names():
        robot = made(name)
        if isinstance(robot, Noised) and not inherited(robot):
            yield f"| `{name}` | {noise(robot)} |"
    yield ""


def inherited(robot: Noised) -> bool:
    """Whether another robot of the page has the same noise."""
    others = [made(name) for name in names()]
    return any(
        isinstance(other, Noised)
        and other is not robot
        and type(other) in type(robot).__mro__[1:]
        and other.noise() == robot.noise()
        for other in others
    )


def noise(robot: Noised) -> str:
    """How far its sensors are from the truth, and where that is known from."""
    doc = inspect.cleandoc(robot.noise.__doc__ or "").partition("\n\n")[2]
    listed = [f"`{path}`: {said(one)}" for path, one in robot.noise().items()]
    return " ".join([*doc.split(), "; ".join(listed)]).strip() or "not known"


def said(noise: Noise) -> str:
    """How much it is, in words, in the field's own unit."""
    words = [f"{noise.relative:.4g} of what is read"] if noise.relative else []
    words += [f"{noise.absolute:.4g}"] if noise.absolute else []
    words += [f"{spread:.2g} at {read:g}" for read, spread in noise.table]
    words += [f"an offset of {noise.bias:g} at most"] if noise.bias else []
    words += [f"steps of {noise.step:.4g}"] if noise.step else []
    return ", ".join(words)


def page() -> str:
    """docs/robots.md, its robots as the definitions are now."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    robots = "\n".join(rows())
    return f"{before}{BEGIN}\n\n{robots}\n{END}{after}"


def main() -> None:
    """Draw all robots, or those that are named, and write the page."""
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or names():
        draw(made(name), PICTURES / f"{name}.png")
        size = (PICTURES / f"{name}.png").stat().st_size
        print(f"docs/robots/{name}.png: {size / 1000:.0f} kB")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
