"""The pictures and the tables of docs/robots.md: `python -m tests.robots.gallery`.

The pictures are kept with the page; the tables are tested.
"""

from __future__ import annotations

import inspect
import re
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
BEGIN, END = "<!-- from here on: python -m tests.robots.gallery -->", "<!-- end -->"


def names() -> list[str]:
    """The built-in robots that have a body."""
    return [n for n in registry.BUILT_IN["definition"] if isinstance(made(n), Embodied)]


def made(name: str) -> Definition:
    """A robot of that name, without a driver."""
    (part,) = by_name("definition")[name]
    cls = part.load()
    assert issubclass(cls, Definition)
    return cls(name)


def tables(name: str) -> Iterator[str]:
    """What the page says of a robot, from the definition itself."""
    (part,) = by_name("definition")[name]
    plain = about(part)
    yield f"## {name}\n"
    yield f"![{name}](robots/{name}.png)\n"
    yield plain["doc"] + "\n"
    yield "| parameter | default | unit | what it is, and its source |"
    yield "|---|---|---|---|"
    for path, field in plain["parameters"].items():
        default = f"{field['default']:.6g}"
        yield f"| `{path}` | {default} | {field['unit']} | {field['doc']} |"
    yield "\n| port | field | unit | range | what it is |\n|---|---|---|---|---|"
    for port in ("command", "state", "sensors"):
        fields = plain["ports"].get(port, {}).get("fields", {})
        rows: dict[tuple[str, ...], list[str]] = {}
        for path, field in fields.items():
            span = " to ".join(f"{end:.4g}" for end in field.get("range", ()))
            unit = field["unit"] or field["type"].replace("float", "")
            # What is alike but for a number, sonar/0 to sonar/15, shares a row.
            alike = re.sub(r"\d+$", "", path) if path[-1].isdigit() else path
            rows.setdefault((alike, unit, span, field["doc"]), []).append(path)
        for (_, unit, span, doc), paths in rows.items():
            called = " to ".join(
                f"`{path}`" for path in dict.fromkeys(paths[:: len(paths) - 1 or 1])
            )
            yield f"| {port} | {called} | {unit} | {span} | {doc} |"
    yield ""
    robot = made(name)
    if isinstance(robot, Noised):
        yield from noise(robot)


def noise(robot: Noised) -> Iterator[str]:
    """How far its sensors are from the truth, and where that is known from."""
    words = inspect.cleandoc(robot.noise.__doc__ or "").partition("\n\n")[2]
    yield f"Noise, on request. {words or 'Nothing is known of it.'}\n"
    rows = [f"| `{path}` | {said(one)} |" for path, one in robot.noise().items()]
    if rows:
        yield from ("| noise of | standard deviation, steps |", "|---|---|", *rows, "")


def said(noise: Noise) -> str:
    """How much it is, in words, in the field's own unit."""
    words = [f"{noise.relative:.4g} of what is read"] if noise.relative else []
    words += [f"{noise.absolute:.4g}"] if noise.absolute else []
    words += [f"{spread:.2g} at {read:g}" for read, spread in noise.table]
    words += [f"an offset of {noise.bias:g} at most"] if noise.bias else []
    words += [f"steps of {noise.step:.4g}"] if noise.step else []
    return ", ".join(words)


def page() -> str:
    """docs/robots.md, its tables as the definitions are now."""
    before = PAGE.read_text(encoding="utf-8").partition(BEGIN)[0]
    robots = "\n".join(line for name in names() for line in tables(name))
    return f"{before}{BEGIN}\n\n{robots}\n{END}\n"


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
