"""`rems board flash` against a stand-in of the ROM loader; esptool is the real one."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rems_net.cable.flash import flash
from rems_net.cable.image import load
from rems_net.errors import FabricError
from tests.commands import Done, finished, rems
from tests.firmware.flashing.images import NVS, content, write
from tests.firmware.flashing.rom import FLASH, Rom

#: commands that change the flash
WRITES = {0x02, 0x03, 0x10, 0x11}


@contextmanager
def board(folder: Path, chip: str = "ESP32", fault: str = "") -> Iterator[Rom]:
    pytest.importorskip("esptool", reason="esptool is not installed: rems-net[board]")
    rom = Rom(folder / "port", chip, fault)
    try:
        yield rom
    finally:
        rom.close()


def typed(folder: Path, rom: Rom, *more: str) -> Done:
    image, port = str(write(folder)), rom.terminal.where
    return rems(folder, "board", "flash", image, "--port", port, *more)


def test_the_image_is_in_the_flash(tmp_path: Path) -> None:
    with board(tmp_path) as rom:
        done = typed(tmp_path, rom)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.endswith(
            "Written, and verified. The robot starts anew.\n"
            f"Next: rems board provision --port {rom.terminal.where} --name NAME "
            "--ssid NETWORK\n"
        )
        assert bytes(rom.flash) == content().ljust(FLASH, b"\xff")


@pytest.mark.parametrize("fault", ["noise", "bit"])
def test_noise_is_overcome(tmp_path: Path, fault: str) -> None:
    """By settings that were there: they stay. Each step of its progress is told."""
    shares: list[float] = []
    with board(tmp_path, fault=fault) as rom:
        start, end = NVS[0], sum(NVS)
        rom.flash[start:end] = b"settings" * (NVS[1] // 8)
        flash(load(write(tmp_path)), rom.terminal.where, tell=shares.append)
        found = bytes(rom.flash[: len(content())])
        assert found[:start] + found[end:] == content()[:start] + content()[end:]
        assert found[start:end] == b"settings" * (NVS[1] // 8)
    assert shares == sorted(shares)
    assert len(shares) > 3
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("chip", ["ESP32-S3", "ESP8266"])
def test_another_chip_is_left_alone(tmp_path: Path, chip: str) -> None:
    with board(tmp_path, chip) as rom:
        with pytest.raises(FabricError, match=f"has the chip {chip}; expected esp32"):
            flash(load(write(tmp_path)), rom.terminal.where)
        assert not WRITES & set(rom.asked)
        assert bytes(rom.flash) == b"\xff" * FLASH


def test_the_stand_in_is_a_rom_loader(tmp_path: Path) -> None:
    """esptool flashes it without its stub, too: by the ROM's own commands."""
    path = write(tmp_path)
    with board(tmp_path) as rom:
        words = [sys.executable, "-m", "esptool", "--chip", "esp32", "--no-stub"]
        words += ["--port", rom.terminal.where, "write-flash", "0x0", str(path)]
        done = finished(words)
        assert done.returncode == 0, done.stderr
        assert {0x02, 0x03, 0x13} <= set(rom.asked)
        assert not {0x05, 0x10} & set(rom.asked)
        assert bytes(rom.flash) == content().ljust(FLASH, b"\xff")
