"""A stand-in of the ESP32's ROM loader, at a pseudo-terminal.

It is written from Espressif's page "Serial Protocol" and the ESP32's register map; the
real esptool is its client. The flash behaves like flash: an erase sets bits, a write
can only clear them. Once a program was loaded to RAM and started, the stand-in answers
as esptool's stub does: two bytes of status instead of four, MD5 as bytes.
"""

import hashlib
import random
import struct
import threading
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from rems_net.emulators.terminal import Terminal

#: bytes of flash, of one of its sectors
FLASH, SECTOR = 4 << 20, 4096
#: values at 0x40001000, which tell one old chip from the other
MAGIC = {"ESP32": 0x00F01D83, "ESP8266": 0xFFF0C101}
#: chip ids of newer chips, which GET_SECURITY_INFO answers
IDS = {"ESP32-S3": 9, "ESP32-C3": 5}
#: a JEDEC id: Winbond, 4 MB
FLASH_ID = 0x1640EF
#: registers of the ESP32: UART divider, and SPI1 of the flash with offsets
UART_DIVIDER = 0x3FF40014
SPI = 0x3FF42000
SPI_COMMAND, SPI_CODE, SPI_DATA = SPI, SPI + 0x24, SPI + 0x80
#: "a user-defined command runs", in SPI_COMMAND
SPI_RUNS = 1 << 18
#: errors of the ROM
INVALID, FAILED, BAD_CHECKSUM = 5, 6, 7
#: what the ROM prints when it was reset into its loader
BOOT_LOG = (
    b"ets Jul 29 2019 12:21:46\r\n\r\nrst:0x1 (POWERON_RESET),"
    b"boot:0x3 (DOWNLOAD_BOOT(UART0/UART1/SDIO_REI_REO_V2))\r\n"
    b"waiting for download\r\n"
)


def framed(packet: bytes) -> bytes:
    """Return a packet in SLIP's frame."""
    escaped = packet.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")
    return b"\xc0" + escaped + b"\xc0"


def plain(frame: bytes) -> bytes:
    """Return what is in a frame."""
    return frame.replace(b"\xdb\xdc", b"\xc0").replace(b"\xdb\xdd", b"\xdb")


class RefusalError(Exception):
    """An error that the ROM answers with."""


class Rom:
    """The loader, in a thread of its own.

    chip: what it is. fault: "" for none; "noise" ahead of its first answers; "silent";
    "unplugged" and "mute" once 40 % of the flash data came; "bit", one bit of a block
    changes on its way; "worn", a bit of the flash does not change, so that MD5 differs.
    """

    def __init__(self, path: Path, chip: str = "ESP32", fault: str = ""):
        pytest.importorskip("pty", reason="There are no pseudo-terminals here.")
        self.chip, self.fault = chip, fault
        self.flash = bytearray(b"\xff" * FLASH)
        #: commands that came, one after the other
        self.asked: list[int] = []
        self.terminal = Terminal(path)
        self._stub = False
        self._baud = 115_200
        self._registers = {
            0x40001000: MAGIC.get(chip, 0),
            UART_DIVIDER: 40_000_000 // 115_200,
        }
        self._at = self._expected = self._total = self._got = 0
        self._inflate: Callable[[bytes], bytes] = bytes
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        """Stop it. A test must not have broken it."""
        self._over.set()
        self._thread.join(10)
        assert not self._thread.is_alive()
        self.terminal.close()

    def _run(self) -> None:
        if self.fault == "noise":
            self.terminal.send(BOOT_LOG + random.Random(7).randbytes(300))
        held = b""
        while not self._over.is_set():
            came = self.terminal.receive(0.02)
            if came and self.terminal.baud != self._baud:
                continue  # at another speed nothing of it is understood
            held += came
            *frames, held = held.split(b"\xc0")
            for frame in filter(None, frames):
                self._answer(plain(frame))

    def _answer(self, packet: bytes) -> None:
        if len(packet) < 8 or self.fault in ("silent", "gone"):
            return
        direction, command, size, checksum = struct.unpack("<BBHI", packet[:8])
        if direction != 0 or size != len(packet) - 8:
            return
        self.asked.append(command)
        value, data, status = 0, b"", bytes(2)
        try:
            value, data = self._done(command, packet[8:], checksum)
        except RefusalError as why:
            status = bytes([1, why.args[0]])
        if self.fault == "gone":
            return
        status += b"" if self._stub else bytes(2)
        head = struct.pack("<BBHI", 1, command, len(data) + len(status), value)
        times = 8 if command == 0x08 else 1
        self.terminal.send(framed(head + data + status) * times)
        if command == 0x06 and self._stub:
            self.terminal.send(framed(b"OHAI"))
        if command == 0x0F:
            self._baud = struct.unpack("<I", packet[8:12])[0]

    def _done(self, command: int, data: bytes, checksum: int) -> tuple[int, bytes]:
        """Return value and data of an answer. Raise RefusalError with its number."""
        words = struct.unpack(f"<{len(data) // 4}I", data[: len(data) // 4 * 4])
        if command == 0x08:  # SYNC; the stub answers 0
            return 0 if self._stub else 0x20120707, b""
        if command == 0x0A:  # READ_REG
            return self._registers.get(words[0], 0), b""
        if command == 0x09:  # WRITE_REG
            self._write_register(words[0], words[1])
        elif command in (0x05, 0x06, 0x07):  # to RAM: begin, end, data
            if command == 0x06:
                self._stub = words[0] == 0
        elif command in (0x02, 0x10):  # FLASH_BEGIN, FLASH_DEFL_BEGIN
            self._begin(words, compressed=command == 0x10)
        elif command in (0x03, 0x11):  # FLASH_DATA, FLASH_DEFL_DATA
            self._write(words[0], words[1], data[16:], checksum)
        elif command == 0x13:  # SPI_FLASH_MD5
            found = hashlib.md5(self.flash[words[0] : words[0] + words[1]])
            return 0, found.digest() if self._stub else found.hexdigest().encode()
        elif command == 0x14 and self.chip in IDS:  # GET_SECURITY_INFO
            return 0, struct.pack("<IB7xII", 0, 0, IDS[self.chip], 0)
        elif command not in (0x04, 0x0B, 0x0D, 0x0F, 0x12):
            raise RefusalError(INVALID)
        return 0, b""

    def _write_register(self, address: int, value: int) -> None:
        self._registers[address] = value
        if address == SPI_COMMAND and value & SPI_RUNS:
            if self._registers.get(SPI_CODE, 0) & 0xFF == 0x9F:  # read the JEDEC id
                self._registers[SPI_DATA] = FLASH_ID
            self._registers[SPI_COMMAND] = 0

    def _begin(self, words: tuple[int, ...], compressed: bool) -> None:
        size, packets, block, self._at = words[:4]
        if self._at % SECTOR or self._at + size > FLASH:
            raise RefusalError(FAILED)
        end = -(-(self._at + size) // SECTOR) * SECTOR
        self.flash[self._at : end] = b"\xff" * (end - self._at)
        self._expected, self._got, self._total = 0, 0, packets * block
        self._inflate = zlib.decompressobj().decompress if compressed else bytes

    def _write(self, size: int, number: int, data: bytes, checksum: int) -> None:
        if self.fault == "bit" and number == 1:
            self.fault = ""
            data = bytes([data[0] ^ 4]) + data[1:]
        seed = 0xEF
        for byte in data:
            seed ^= byte
        if seed != checksum:
            raise RefusalError(0xC1 if self._stub else BAD_CHECKSUM)
        if len(data) != size or number != self._expected:
            raise RefusalError(INVALID)
        self._expected += 1
        self._got += size
        written = self._inflate(data)
        for i, byte in enumerate(written):
            self.flash[self._at + i] &= byte
        if self.fault == "worn":
            self.flash[self._at] ^= 1
        self._at += len(written)
        if self.fault in ("unplugged", "mute") and self._got >= 0.4 * self._total:
            if self.fault == "unplugged":
                self.terminal.unplug()
            self.fault = "gone"
