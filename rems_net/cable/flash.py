"""Flash: write an image to a board at a USB cable, by Espressif's esptool.

esptool runs as a program of its own. It resets the board into its loader, compares the
chip, writes, and compares the MD5 of what the flash then holds.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rems_net.cable.image import Image
from rems_net.cable.port import open_port
from rems_net.errors import FabricError, MissingPartError

#: bit/s. All USB chips of these boards can do it; four times the usual speed.
BAUD = 460_800
#: Oldest major version: it introduced the command names that are used here.
OLDEST = 5
#: Environment of esptool for a pipe: no colours, no folded lines, UTF-8.
PLAIN = {"NO_COLOR": "1", "COLUMNS": "200", "PYTHONIOENCODING": "utf-8"}


def flash(
    image: Image,
    device: str,
    baud: int = BAUD,
    tell: Callable[[float], None] = lambda _: None,
) -> None:
    """Write an image to the board at a port, and verify it.

    baud: bit/s.
    tell: called with the written share, 0 to 1. Raises MissingPartError if esptool is
        not installed; FabricError if the port can't be opened, nothing answers there,
        the chip is another one, or the cable fails.
    """
    look_for_esptool()
    open_port(device).close()
    parts = image.parts()
    with tempfile.TemporaryDirectory() as folder:
        pairs: list[str] = []
        for i, (offset, content) in enumerate(parts):
            path = Path(folder) / f"{i}.bin"
            path.write_bytes(content)
            pairs += [f"{offset:#x}", str(path)]
        words = [sys.executable, "-u", "-m", "esptool", "--chip", image.chip]
        words += ["--port", device, "--baud", str(baud), "write-flash", *pairs]
        with subprocess.Popen(
            words,
            env=os.environ | PLAIN,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        ) as esptool:
            try:
                written, said = _follow(esptool, [len(c) for _, c in parts], tell)
            except BaseException:
                esptool.kill()
                raise
    if esptool.returncode != 0:
        why = _refusal(image, device, written, said)
        raise FabricError(f"{why} (R0704)")


def look_for_esptool() -> None:
    """Raise MissingPartError if esptool is not installed, or is too old."""
    todo = 'Type: pip install "rems-net[board]"'
    try:
        found = version("esptool")
    except PackageNotFoundError:
        raise MissingPartError(
            f"esptool, which writes to the board, is not installed. {todo} (R0704)"
        ) from None
    if int(found.partition(".")[0]) < OLDEST:
        raise MissingPartError(
            f"esptool {found} is installed; expected {OLDEST} or newer. {todo} (R0704)"
        )


def _follow(
    esptool: subprocess.Popen[str], sizes: list[int], tell: Callable[[float], None]
) -> tuple[float, str]:
    """Return the written share, and the error message of esptool, when it has ended."""
    share, done, said, last = 0.0, 0, "", "it gives no reason"
    left = list(sizes)
    assert esptool.stdout is not None
    for line in esptool.stdout:
        if found := re.match(r"Writing at .*?([\d.]+)%", line):
            share = (done + left[0] * float(found[1]) / 100) / sum(sizes)
            tell(share)
        elif line.startswith("Wrote ") and len(left) > 1:
            done += left.pop(0)
        elif found := re.search(r"(?:error occurred|exception error): (.*)", line):
            said = found[1]
        else:
            last = line.strip() or last
    return share, said or last


def _refusal(image: Image, device: str, written: float, said: str) -> str:
    """Return what failed and what to do, in sentences."""
    if chip := re.match(r"This chip is (\S+), not", said):
        return (
            f"the board at {device} has the chip {chip[1]}; expected {image.chip}, for "
            f"which {image.path.name} is made. Nothing was written. Is this the "
            "robot's port? Type: rems board ports"
        )
    if "Failed to connect" in said:
        return (
            f"no board answers at {device}. Nothing was written. Hold the board's "
            "button BOOT down while you type it again, until it writes. If that does "
            "not help: another USB cable (some only charge), another port."
        )
    if "MD5" in said:
        return (
            f"the flash of the board at {device} does not hold what was written to it. "
            "Do not use the robot. Type the same again; if it fails twice, the board "
            "is broken."
        )
    if written:
        return (
            f"the board at {device} was lost after {written:.0%} ({said}). It does not "
            "start with half an image, and nothing is broken. Plug the cable in "
            "firmly, and type the same again; with --baud 115200 if it fails twice."
        )
    return f"esptool can't write to the board at {device}: {said}"
