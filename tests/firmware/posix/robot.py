"""Robot: a Woodbot as a process of a rig, and what its servos did."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import HERE, Rig


class Pulses(NamedTuple):
    """What the servos get from `at` on (CLOCK_MONOTONIC, s), in microseconds."""

    at: float
    left: int
    right: int

    @property
    def stands(self) -> bool:
        return self.left == self.right == 0


class Robot:
    """It ends with its rig."""

    def __init__(
        self,
        rig: Rig,
        program: Path,
        name: str,
        router: str,
        *words: str,
        machine: str = HERE,
    ):
        self.name = name
        self._servos = rig.folder / f"{name}.servos"
        told = ["--name", name, "--router", router, "--control", "-"]
        told += ["--servos", str(self._servos), *words]
        self.process = rig.start(name, [str(program), *told], machine)
        self._log: list[Pulses] = []
        self._read = 0

    def control(self, line: str) -> str:
        """Have something happen to it; its answer."""
        return self.process.ask(line)

    def pulses(self) -> list[Pulses]:
        """All changes so far. The two wheels change one after the other."""
        if not self._servos.exists():
            return self._log
        with self._servos.open("rb") as file:
            file.seek(self._read)
            for line in file:
                if not line.endswith(b"\n"):
                    break
                self._read += len(line)
                at, left, right = line.split()
                self._log.append(Pulses(float(at), int(left), int(right)))
        return self._log

    def since(
        self, at: float, which: Callable[[Pulses], bool], seconds: float, what: str
    ) -> float:
        """When, after `at`, the first such change was. Raises TimeoutError."""

        def look() -> Pulses | None:
            for one in reversed(self.pulses()):
                if one.at < at:
                    break
                if which(one):
                    found.append(one)
            return found[-1] if found else None

        found: list[Pulses] = []
        return until(look, f"{self.name}: {what}", seconds).at

    def stood(self, at: float, seconds: float = 10.0) -> float:
        """When it stood still, at or after `at`."""
        last = self.pulses()
        if last and last[-1].stands and last[-1].at <= at:
            return at
        return self.since(at, lambda one: one.stands, seconds, "standing still")

    def moved(self, at: float, seconds: float = 20.0) -> float:
        """When it first moved after `at`."""
        return self.since(at, lambda one: not one.stands, seconds, "moving again")

    def heap(self) -> int:
        """Bytes of the heap that are in use."""
        return int(self.control("heap").split()[1])

    def resident(self) -> int:
        """Bytes of memory that it takes."""
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="utf-8")
        line = next(one for one in status.splitlines() if one.startswith("VmRSS"))
        return 1024 * int(line.split()[1])
