"""What one task hands over to another: never torn, never waited for."""

from pathlib import Path

import pytest

from tests.commands import finished
from tests.firmware.compiling import CORE, FIRMWARE, STRICT, build, compiler

SOURCES = [CORE / "safety" / "handover.c", FIRMWARE / "test" / "test_handover.c"]
WRITES = 300_000


@pytest.mark.parametrize(
    ("name", "flags"),
    [("gcc", ["-Os"]), ("clang", ["-O2"]), ("clang", ["-O1", "-fsanitize=thread"])],
)
def test_two_threads(tmp_path: Path, name: str, flags: list[str]) -> None:
    """Also with the sanitizer of threads, which looks for what is not atomic."""
    words = [compiler(name), *STRICT, *flags, f"-I{CORE}", *map(str, SOURCES)]
    program = build([*words, "-pthread"], tmp_path / "test_handover")
    done = finished([program, str(WRITES)])
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
    reads, good, changes = map(int, done.stdout.split())
    assert reads >= good >= changes >= 1
