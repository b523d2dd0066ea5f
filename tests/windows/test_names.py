"""Files and folders with the names that Windows' users have."""

from pathlib import Path

import pytest

from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]

CART = """\
from rems_net import Definition, In, Out, Schema
from rems_net.units import length, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command["speed"]}
"""
LAB = """\
[experiment]
name = "{name}"
dt = "50 ms"
duration = "1 s"
direct = true

[[input]]
name = "keys"
type = "csv"
options = {{ file = '{folder}keys.csv' }}

[[robot]]
name = "sim"
definition = '{folder}mein wägen.py:Cart'
driver = "kinematic"
command = "input/keys"

[[output]]
name = "log"
type = "csv"
"""
#: runs several experiments in one process
ALL = """\
import sys
from pathlib import Path
from rems_net.cli import main
for path in sorted(Path().glob("*.toml")):
    assert main(["run", path.name]) == 0, path
"""


def test_paths(windows: Windows, tmp_path: Path) -> None:
    """Blanks, umlauts, drive letters, both slashes, and a share of a network."""
    folder = tmp_path / "Übung 1 (OneDrive)"
    folder.mkdir()
    (folder / "mein wägen.py").write_text(CART, encoding="utf-8")
    keys = "time [s],command/speed [m/s]\n1,0.1\n"
    (folder / "keys.csv").write_text(keys, encoding="utf-8")
    (folder / "all.py").write_text(ALL, encoding="utf-8")
    windows_path = str(folder).replace("/", "\\")
    ways = {
        "relative": "",
        "drive": f"Z:{windows_path}\\",
        "slashes": f"z:{folder}/",
        "share": rf"\\?\unix{windows_path}" + "\\",
    }
    for name, way in ways.items():
        text = LAB.format(name=name, folder=way)
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    windows.python("all.py", cwd=folder)
    made = [folder / "runs" / name / "sim.csv" for name in ways]
    assert len({path.read_bytes() for path in made}) == 1


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8"])
def test_output_of_every_console(
    windows: Windows, tmp_path: Path, encoding: str
) -> None:
    """Redirected, and in a console of Western letters: nothing ends a command."""
    folder = tmp_path / "Übung → 機器人"
    folder.mkdir()
    (folder / "lab.toml").write_text("[experiment]\n", encoding="utf-8")
    words = ["run", "lab.toml", "--out", "→ 機器人"]
    printed = windows.rems(*words, cwd=folder, fails=True, PYTHONIOENCODING=encoding)
    assert "R0416" in printed, printed


def test_a_recording_that_another_program_holds(
    windows: Windows, tmp_path: Path
) -> None:
    """As Excel does: the run is refused in one sentence, and nothing is lost."""
    (tmp_path / "mein wägen.py").write_text(CART, encoding="utf-8")
    keys = "time [s],command/speed [m/s]\n1,0.1\n"
    (tmp_path / "keys.csv").write_text(keys, encoding="utf-8")
    text = LAB.format(name="lab", folder="")
    (tmp_path / "lab.toml").write_text(text, encoding="utf-8")
    windows.rems("run", "lab.toml", "--out", "here", cwd=tmp_path)
    before = (tmp_path / "here" / "sim.csv").read_bytes()
    (tmp_path / "held.py").write_text(HELD, encoding="utf-8")
    printed = windows.python("held.py", cwd=tmp_path, fails=True)
    assert r"Close what has its files open" in printed
    assert "--out here.1" in printed
    assert (tmp_path / "here" / "sim.csv").read_bytes() == before


#: holds a recording for itself, and runs the experiment again
HELD = """\
import _winapi, sys
from rems_net.cli import main
READ, ALONE, OPEN = 0x80000000, 0, 3
held = _winapi.CreateFile("here/sim.csv", READ, ALONE, 0, OPEN, 0, 0)
sys.exit(main(["run", "lab.toml", "--out", "here"]))
"""
