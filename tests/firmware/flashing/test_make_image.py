"""deploy/board/make_image.py: the real esptool merges what PlatformIO has built.

PlatformIO itself fetches a compiler of 1 GB; a program of its name stands in for it,
and leaves what it leaves (`.pio/build/woodbot/idedata.json` and the images).
"""

import json
import sys
from pathlib import Path

import pytest

from rems_net.cable.image import load
from tests.commands import ROOT, Done, environment, finished
from tests.firmware.flashing.images import content, schemas

#: offset and name of each piece, as the espressif32 platform lays them out
PIECES = {0x1000: "bootloader.bin", 0x8000: "partitions.bin", 0x10000: "firmware.bin"}
PIO = """#!{python}
import json, pathlib, sys
words = sys.argv[1:]
project = pathlib.Path(words[words.index("--project-dir") + 1])
assert (project / "platformio.ini").exists()
assert words[words.index("--environment") + 1] == "woodbot"
build, here = project / ".pio/build/woodbot", pathlib.Path({built!r})
build.mkdir(parents=True, exist_ok=True)
images = [dict(offset="0x1000", path=str(here / "bootloader.bin")),
          dict(offset="0x8000", path=str(here / "partitions.bin"))]
extra = dict(flash_images=images, application_offset="0x10000")
found = dict(prog_path=str(here / "firmware.elf"), extra=extra)
if "idedata" in words:
    (build / "idedata.json").write_text(json.dumps(found))
"""


pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows does not run the script that stands in."
)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout of its own: the build writes into it."""
    for name in ("deploy/board/make_image.py", "firmware/esp32_woodbot/core/console.h"):
        copy(name, tmp_path)
    copy("firmware/esp32_woodbot/core/woodbot_schemas.c", tmp_path)
    copy("firmware/esp32_woodbot/esp32/platformio.ini", tmp_path)
    return tmp_path


def copy(name: str, folder: Path) -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes((ROOT / name).read_bytes())


def made(checkout: Path, path: str) -> Done:
    words = [sys.executable, "deploy/board/make_image.py", "--into", "images"]
    return finished(words, checkout, environment(PATH=path))


def test_an_image_and_its_manifest(checkout: Path) -> None:
    pytest.importorskip("esptool", reason="esptool is not installed: rems-net[board]")
    whole = content()
    ends = [0x1400, 0x8C00, len(whole)]
    for (start, name), end in zip(PIECES.items(), ends, strict=True):
        (checkout / name).write_bytes(whole[start:end])
    pio = checkout / "bin" / "pio"
    pio.parent.mkdir()
    pio.write_text(PIO.format(python=sys.executable, built=str(checkout)))
    pio.chmod(0o755)
    done = made(checkout, str(pio.parent))
    assert done.returncode == 0, done.stderr
    path = Path("images/woodbot-0.1.0.bin")
    assert done.stdout.endswith(f"Next: rems board flash {path}\n")
    image = load(checkout / path)
    assert image.content == whole
    assert (image.chip, image.offset, image.version) == ("esp32", 0, "0.1.0")
    assert image.schemas == schemas()
    manifest = json.loads((checkout / path).with_suffix(".json").read_text())
    assert manifest["image"] == path.name


def test_without_platformio(checkout: Path) -> None:
    (checkout / "bin").mkdir()
    done = made(checkout, str(checkout / "bin"))
    assert done.returncode == 1
    assert done.stderr == "PlatformIO is missing. Type: pip install platformio\n"


def test_a_build_that_fails(checkout: Path) -> None:
    pio = checkout / "bin" / "pio"
    pio.parent.mkdir()
    pio.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no compiler')\n")
    pio.chmod(0o755)
    done = made(checkout, str(pio.parent))
    assert done.returncode == 1
    assert "PlatformIO failed: what it printed above says why." in done.stderr
