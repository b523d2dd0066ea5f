"""The board's Wi-Fi, compiled here against as much of ESP-IDF as it uses."""

import re
from pathlib import Path

from tests.firmware.compiling import CORE, FIRMWARE, STRICT, build, compiler
from tests.firmware.program import run

TEST, ESP32 = FIRMWARE / "test", FIRMWARE / "esp32"
WIFI = ESP32 / "network" / "wifi.c"


def test_networks_and_why_they_are_lost(tmp_path: Path) -> None:
    for name in re.findall(r"#include <(esp_\w+\.h)>", WIFI.read_text("utf-8")):
        (tmp_path / name).write_text('#include "idf.h"\n', encoding="utf-8")
    folders = (tmp_path, TEST, CORE, ESP32, FIRMWARE / "parts")
    words = [compiler(), *STRICT, *(f"-I{folder}" for folder in folders)]
    lines = run(build([*words, TEST / "test_wifi.c", WIFI], tmp_path / "test_wifi"))
    assert lines[-1] == "ok an address"
    assert all(line.startswith("ok ") for line in lines)
    assert len(lines) == 11
