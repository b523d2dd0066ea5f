"""DefDict against its ancestor and against plain msgpack, in one run.

    python -m benchmarks.defdict

Each line is a promise: what is compared, the two times, their ratio, the bound. The
ancestor is defdict 0.1.1 from PyPI (`pip install rems-net[bench]`). Times are the
best of several repeats, in microseconds; the run fails if a promise is broken.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rems_net.defdict import Schema, angle, length, velocity

Call = Callable[[], Any]


@dataclass(frozen=True)
class Promise:
    """`ours` against `theirs`; `bound` on the ratio."""

    name: str
    theirs: float
    ours: float
    bound: float
    faster: bool  # whether ours must be that much faster, or may be that much slower

    @property
    def ratio(self) -> float:
        """How many times faster, or how many times slower."""
        return self.theirs / self.ours if self.faster else self.ours / self.theirs

    @property
    def kept(self) -> bool:
        """Whether the promise holds."""
        return self.ratio >= self.bound if self.faster else self.ratio <= self.bound

    def __str__(self) -> str:
        how = f"{'>=' if self.faster else '<='} {self.bound:g}"
        mark = "ok" if self.kept else "BROKEN"
        return (
            f"{self.name:52} {self.theirs:10.3f} {self.ours:10.3f} "
            f"{self.ratio:9.2f}  {how:8} {mark}"
        )


def best(call: Call, number: int, repeat: int = 9) -> float:
    """Return the microseconds of one call, the best of several repeats."""
    return min(timeit.repeat(call, number=number, repeat=repeat)) / number * 1e6


def against_the_ancestor() -> list[Promise]:
    """Convert, set and build three fields with units."""
    old: Any = importlib.import_module("defdict")
    fields = {"x": old.Pos, "y": old.Pos, "a": old.Ang}
    source = old.DefDict(fields)
    other = old.DefDict(
        {"x": old.Pos(unit="mm"), "y": old.Pos(unit="mm"), "a": old.Ang(unit="deg")}
    )
    numbers = {"x": 1.0, "y": 2.0, "a": 3.0}
    schema = Schema("pose", {"x": length("m"), "y": length("m"), "a": angle("rad")})
    edge = Schema("pose", {"x": length("mm"), "y": length("mm"), "a": angle("deg")})
    value, convert = schema(numbers), schema.converter(edge)

    def attributes() -> None:
        value.x = 1.0
        value.y = 2.0
        value.a = 3.0

    def define() -> Any:
        made = Schema("p", {"x": length("m"), "y": length("m"), "a": angle("rad")})
        return made()

    setting = best(lambda: source.set(numbers), 500)
    building = best(lambda: old.DefDict(fields), 100)
    return [
        Promise(
            "convert 3 fields to other units",
            best(lambda: other.set(source), 100),
            best(lambda: convert(value), 20_000),
            60,
            True,
        ),
        Promise(
            "set 3 values, as attributes", setting, best(attributes, 20_000), 15, True
        ),
        Promise(
            "set 3 values, from a dict",
            setting,
            best(lambda: value.update(numbers), 20_000),
            15,
            True,
        ),
        Promise("build a value of a schema", building, best(schema, 20_000), 300, True),
        Promise(
            "define a schema and build a value", building, best(define, 500), 100, True
        ),
    ]


def against_plain_python() -> list[Promise]:
    """Send a state of four fields; set one float."""
    msgpack: Any = importlib.import_module("msgpack")
    numbers = {"x": 1.0, "y": 2.0, "theta": 3.0, "v": 4.0}
    schema = Schema(
        "state",
        {"x": length("m"), "y": length("m"), "theta": angle("rad"), "v": velocity()},
    )
    edge = Schema(
        "state",
        {"x": length("mm"), "y": length("mm"), "theta": angle("deg"), "v": velocity()},
    )
    value, convert = schema(numbers), schema.converter(edge)
    packed = msgpack.packb(numbers)
    if value.encode() != packed:
        raise SystemExit("the payload is not what msgpack packs")

    def raw() -> None:
        msgpack.unpackb(msgpack.packb(numbers))

    def whole() -> None:
        convert.decode(value.encode())

    def set_plain(loops: int) -> float:
        return min(timeit.repeat("d['x'] = 1.0", globals={"d": numbers}, number=loops))

    def set_ours(loops: int) -> float:
        return min(timeit.repeat("d['x'] = 1.0", globals={"d": value}, number=loops))

    loops = 200_000
    return [
        Promise(
            "encode + decode + convert 4 fields, against msgpack",
            best(raw, 20_000),
            best(whole, 20_000),
            1,
            False,
        ),
        Promise(
            "set one float by key, against a dict",
            set_plain(loops) / loops * 1e6,
            set_ours(loops) / loops * 1e6,
            10,
            False,
        ),
    ]


def imports() -> list[Promise]:
    """Import rems_net and its DefDicts in a fresh process; unyt stays out."""

    def fresh(code: str) -> float:
        program = (
            "import time; t = time.perf_counter()\n"
            f"{code}\n"
            "t = time.perf_counter() - t\n"
            "import sys; print(t * 1e6, 'unyt' in sys.modules)"
        )
        runs = [
            subprocess.run(
                [sys.executable, "-c", program],
                capture_output=True,
                text=True,
                check=True,
            ).stdout.split()
            for _ in range(7)
        ]
        if any(run[1] != "False" for run in runs):
            raise SystemExit(f"{code} imports unyt")
        return min(float(run[0]) for run in runs)

    floor = fresh("import zenoh, msgpack, numpy")
    return [
        Promise("import rems_net", floor, fresh("import rems_net"), 3, False),
        Promise(
            "import rems_net and rems_net.defdict",
            floor,
            fresh("import rems_net, rems_net.defdict"),
            3,
            False,
        ),
    ]


def main() -> int:
    """Print the table; return 1 if a promise is broken."""
    try:
        importlib.import_module("defdict")
    except ModuleNotFoundError as missing:
        print(f'{missing.name} is missing: pip install "rems-net[bench]"')
        return 2
    print(f"{'':52} {'theirs us':>10} {'ours us':>10} {'ratio':>9}  promise")
    promises = [*against_the_ancestor(), *against_plain_python(), *imports()]
    print(*promises, sep="\n")
    return 0 if all(promise.kept for promise in promises) else 1


if __name__ == "__main__":
    sys.exit(main())
