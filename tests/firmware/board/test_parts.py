"""The Woodbot's sensors against their chips' registers, compiled here."""

from pathlib import Path

import pytest

from tests.firmware.compiling import CORE, FIRMWARE, STRICT, build, compiler
from tests.firmware.program import run

PARTS = FIRMWARE / "parts"


def test_sensors_by_their_registers(tmp_path: Path) -> None:
    sources = [FIRMWARE / "test" / "test_parts.c", *sorted(PARTS.glob("*.c"))]
    words = [compiler(), *STRICT, f"-I{CORE}", f"-I{PARTS}"]
    lines = run(build([*words, *sources, "-lm"], tmp_path / "test_parts"))
    assert lines[-1] == "ok no expander"
    assert all(line.startswith("ok ") for line in lines)
    assert len(set(lines)) == 31


def test_a_wrong_register_is_noticed(tmp_path: Path) -> None:
    """The gyro's status is at 1Eh; where another register is asked, the test fails."""
    for source in (FIRMWARE / "test" / "test_parts.c", *PARTS.iterdir()):
        text = source.read_text(encoding="utf-8")
        text = text.replace("STATUS_REG = 0x1E", "STATUS_REG = 0x1D")
        (tmp_path / source.name).write_text(text, encoding="utf-8")
    words = [compiler(), *STRICT, f"-I{CORE}"]
    changed = sorted(tmp_path.glob("*.c"))
    program = build([*words, *changed, "-lm"], tmp_path / "test_parts")
    with pytest.raises(AssertionError, match="FAIL a rate counter-clockwise"):
        run(program)
