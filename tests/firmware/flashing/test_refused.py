"""What `rems board flash` refuses, and what it prints if the cable or board fails."""

from contextlib import suppress
from pathlib import Path

import pytest

from rems_net.cable import image
from rems_net.cable.flash import flash
from rems_net.cable.image import load
from rems_net.cli import main
from rems_net.errors import ExperimentError, FabricError
from tests.firmware.flashing.images import content, write
from tests.firmware.flashing.test_flash import board


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("silent", "no board answers at .* Nothing was written. Hold .* BOOT down"),
        ("unplugged", "was lost after [2-9][0-9]% .* type the same again"),
        ("worn", "does not hold what was written to it"),
    ],
)
def test_a_board_that_fails(
    tmp_path: Path, fault: str, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """esptool is told, by its own file of settings, to give up soon."""
    (tmp_path / "soon.cfg").write_text("[esptool]\nconnect_attempts = 1\n")
    monkeypatch.setenv("ESPTOOL_CFGFILE", str(tmp_path / "soon.cfg"))
    with board(tmp_path, fault=fault) as rom:
        with pytest.raises(FabricError, match=says):
            flash(load(write(tmp_path)), rom.terminal.where)
        assert bytes(rom.flash[: len(content())]) != content()


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"sha256": "0" * 64}, "is damaged, or it is another image than"),
        ({"bytes": 5}, "expected 5 and "),
        ({"chip": "esp8266"}, "is for the chip 'esp8266' at offset 0; expected esp32"),
        ({"offset": -1}, "at offset -1"),
        ({"offset": True}, "has no offset that can be read"),
        ({"sha256": 7}, "has no sha256 that can be read"),
    ],
)
def test_an_image_that_does_not_fit_its_manifest(
    tmp_path: Path, changed: dict[str, object], says: str
) -> None:
    with pytest.raises(ExperimentError, match=says):
        load(write(tmp_path, **changed))


def test_files_that_are_no_image(tmp_path: Path) -> None:
    path = write(tmp_path)
    manifest = path.with_suffix(".json")
    for text in ("[" * 16_000, "{", "[]", "null", "\x00"):
        manifest.write_text(text)
        with pytest.raises(ExperimentError, match="once more"):
            load(path)
    manifest.write_bytes(b"\xff\xfe")
    with pytest.raises(ExperimentError, match="damaged: expected JSON"):
        load(path)
    manifest.write_text(" " * (image.LARGEST_MANIFEST + 1))
    with pytest.raises(ExperimentError, match="It is no image"):
        load(path)
    manifest.unlink()
    with pytest.raises(ExperimentError, match=r"woodbot-0.1.0.json is missing: "):
        load(path)
    path.unlink()
    with pytest.raises(ExperimentError, match=r"no file .*woodbot-0.1.0.bin"):
        load(path)
    with pytest.raises(ExperimentError, match=r"expected a file that ends in .bin"):
        load(manifest)


def test_one_changed_byte_is_found(tmp_path: Path) -> None:
    path = write(tmp_path)
    changed = bytearray(path.read_bytes())
    changed[0x12345] ^= 1
    path.write_bytes(changed)
    with pytest.raises(ExperimentError, match="Nothing was written"):
        load(path)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["burn", "a.bin"], "rems board has no verb 'burn'"),
        (["flash", "none.bin"], "There is no file none.bin. Type the path"),
    ],
)
def test_what_is_typed_wrong(
    capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    with suppress(SystemExit):  # as argparse ends for an unknown verb
        assert main(["board", *words]) == 2
    assert says in capsys.readouterr().err


def test_an_image_of_another_version(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A warning, and the port is looked at before esptool is started."""
    pytest.importorskip("esptool", reason="esptool is not installed: rems-net[board]")
    path = write(tmp_path, schemas={"command": "0123456789abcdef"})
    none = str(tmp_path / "none")
    assert main(["board", "flash", str(path), "--port", none]) == 2
    warning, refusal = capsys.readouterr().err.splitlines()
    assert "was made by another version of rems-net" in warning
    assert refusal.startswith(f"rems: there is no port {none}.")


def test_several_boards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The only port of USB is taken; of several, each is named."""
    from rems_net.cli.board import flash as verb
    from rems_net.drivers.hardware import ports

    pytest.importorskip("esptool", reason="esptool is not installed: rems-net[board]")
    found = [ports.Port("COM3", "", True), ports.Port("COM1", "", False)]
    for module in (ports, verb):
        monkeypatch.setattr(module, "ports", lambda: found)
    assert verb._port() == "COM3"
    found.append(ports.Port("COM4", "", True))
    with pytest.raises(FabricError, match=r"write --port. There are: COM3, COM4"):
        verb._port()
    del found[0], found[1]
    with pytest.raises(FabricError, match="There is none of USB here"):
        verb._port()


def test_without_esptool(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from importlib.metadata import PackageNotFoundError

    from rems_net.cable import flash as module
    from rems_net.errors import MissingPartError

    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(module, "version", missing)
    with pytest.raises(MissingPartError, match=r'pip install "rems-net\[board\]"'):
        flash(load(write(tmp_path)), "COM3")
    monkeypatch.setattr(module, "version", lambda _: "4.8.1")
    with pytest.raises(MissingPartError, match=r"esptool 4.8.1 .* expected 5 or newer"):
        flash(load(write(tmp_path)), "COM3")
