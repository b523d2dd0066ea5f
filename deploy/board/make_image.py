"""Make the image of a class: build the firmware once, merge it, write its manifest.

Run it where PlatformIO works, from a checkout of rems_net:

    pip install "rems-net[board]" platformio
    python deploy/board/make_image.py --into images

It writes woodbot-VERSION.bin, and woodbot-VERSION.json with the chip, the offset, the
size, the SHA-256 and the digests of the schemas. Students then need neither PlatformIO
nor a compiler: `rems board flash woodbot-VERSION.bin`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

FIRMWARE = Path(__file__).parents[2] / "firmware" / "esp32_woodbot"
#: the environment of platformio.ini, and its chip as esptool names it
ENVIRONMENT, CHIP = "woodbot", "esp32"


def main() -> int:
    """Build, merge, describe. Return 1 if a tool is missing or fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--into", metavar="DIR", type=Path, default=Path(), help="folder for the files"
    )
    into = parser.parse_args().into
    if shutil.which("pio") is None:
        print("PlatformIO is missing. Type: pip install platformio", file=sys.stderr)
        return 1
    project = ["--project-dir", str(FIRMWARE / "esp32"), "--environment", ENVIRONMENT]
    try:
        subprocess.run(["pio", "run", *project], check=True)
        subprocess.run(["pio", "run", *project, "--target", "idedata"], check=True)
        into.mkdir(parents=True, exist_ok=True)
        image = into / f"woodbot-{version()}.bin"
        merge(pieces(), image)
    except subprocess.CalledProcessError as error:
        tool = "esptool" if "esptool" in error.cmd else "PlatformIO"
        print(f"{tool} failed: what it printed above says why.", file=sys.stderr)
        return 1
    manifest = image.with_suffix(".json")
    manifest.write_text(json.dumps(describe(image), indent=2) + "\n", encoding="utf-8")
    print(f"Made {image} and {manifest}. Next: rems board flash {image}")
    return 0


def version() -> str:
    """Return the version of the firmware, as its console prints it."""
    text = (FIRMWARE / "core" / "console.h").read_text(encoding="utf-8")
    found = re.search(r'WOODBOT_VERSION "([^"]+)"', text)
    assert found, "core/console.h has no WOODBOT_VERSION"
    return found[1]


def pieces() -> list[str]:
    """Return offsets and files that the build made, one after the other."""
    built = FIRMWARE / "esp32" / ".pio" / "build" / ENVIRONMENT / "idedata.json"
    found = json.loads(built.read_text(encoding="utf-8"))
    each = [(one["offset"], one["path"]) for one in found["extra"]["flash_images"]]
    firmware = Path(found["prog_path"]).with_suffix(".bin")
    each.append((found["extra"]["application_offset"], str(firmware)))
    return [word for pair in each for word in pair]


def merge(words: list[str], image: Path) -> None:
    """Write one image for offset 0, with bytes 0xFF between the pieces."""
    esptool = [sys.executable, "-m", "esptool", "--chip", CHIP, "merge-bin"]
    subprocess.run([*esptool, "--output", str(image), *words], check=True)


def describe(image: Path) -> dict[str, Any]:
    """Return what `rems board flash` checks before it writes."""
    tables = (FIRMWARE / "core" / "woodbot_schemas.c").read_text(encoding="utf-8")
    found = re.findall(r'\.port = "(\w+)".*?\.digest = "(\w+)"', tables, re.DOTALL)
    content = image.read_bytes()
    return {
        "image": image.name,
        "version": version(),
        "chip": CHIP,
        "offset": 0,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        "schemas": dict(found),
    }


if __name__ == "__main__":
    sys.exit(main())
