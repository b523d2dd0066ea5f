"""The firmware's own tests in C: compiled here, that of the codec with any tables."""

import subprocess
from pathlib import Path

from rems_net.agents.robot import Definition
from rems_net.defdict.wire.reader import longest
from rems_net.firmware import fits
from rems_net.packing import pack
from tests.firmware.compiling import SANITIZE, STRICT, build, compiler

SOURCES = ("core/codec.c", "core/woodbot_schemas.c", "test/test_codec.c")


def compiled(firmware: Path, folder: Path, names: tuple[str, ...] = SOURCES) -> Path:
    """The program, called as its last source is; with sanitizers where they run."""
    more = SANITIZE if _works([compiler(), *SANITIZE], folder) else []
    sources = [firmware / name for name in names]
    words: list[str | Path] = [compiler(), *STRICT, "-O1", *more, *sources]
    return build(words, folder / sources[-1].stem)


def _works(command: list[str], folder: Path) -> bool:
    """Whether a program of one line compiles, links and runs."""
    (folder / "one.c").write_text("int main(void) { return 0; }\n", encoding="utf-8")
    made = [*command, str(folder / "one.c"), "-o", str(folder / "one")]
    if subprocess.run(made, capture_output=True, check=False).returncode != 0:
        return False
    ran = subprocess.run([folder / "one"], capture_output=True, check=False)
    return ran.returncode == 0


def run(program: Path, *words: str | Path) -> list[str]:
    """What it prints."""
    done = subprocess.run(
        [program, *words],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
    return done.stdout.splitlines()


def check_tables(lines: list[str], definition: type[Definition]) -> None:
    """Hold what the firmware knows of its messages against a definition."""
    robot = definition("woodbot")
    robot.prepare()
    every = robot.published()
    rows: dict[str, list[list[str]]] = {}
    for name, *words in (line.split(",") for line in lines):
        rows.setdefault(name, []).append(words)
    for port, schema in every.items():
        encoding = f"application/msgpack;{schema.name}@{schema.digest}"
        words = [schema.name, schema.digest, encoding, str(longest(schema))]
        assert rows[port] == [[*words, schema.to_wire().hex()]]
    assert [
        [path, unit, *map(float.fromhex, rest)] for path, unit, *rest in rows[""]
    ] == [
        [path, field.unit, *field.limits, field.default]
        for schema in every.values()
        for path, field in schema.rows()
    ]
    wires = {port: schema.to_wire() for port, schema in every.items()}
    payload, *limits = map(int, rows["bounds"][0])
    assert payload == max(map(longest, every.values()))
    assert limits == [fits.MOST_FIELDS, fits.MOST_KEY, fits.MOST_DEPTH]
    sizes = [max(map(len, wires.values())), len(pack(wires)), len(every)]
    assert list(map(int, rows["sizes"][0])) == sizes
    age, micros, radius, track = rows["robot"][0]
    assert float.fromhex(age) == robot.max_age == int(micros) / 1e6
    assert float.fromhex(radius) == robot.parameters["wheel_radius"]
    assert float.fromhex(track) == robot.parameters["track"]
