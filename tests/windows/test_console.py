"""How a program ends in a Windows console: its robots stand, recordings are whole."""

import re
from pathlib import Path

import pytest

from tests.agents.runs import free_port, until
from tests.windows.console import console
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]

#: the last bytes of a recording that has its end, by the specification of MCAP
MAGIC = b"\x89MCAP0\r\n"
#: what a person does, in a program around `rems`: after some rows of its recording.
#: argv: what happens, and the words of `rems`
AROUND = """\
import ctypes, sys, threading, time
from pathlib import Path
from rems_net.cli import main

def act():
    log = Path("runs", "lab", "sim.csv")
    while not log.exists() or log.read_bytes().count(b"\\n") < 20:
        time.sleep(0.1)
    # as Windows does it: a thread that calls the handlers one by one
    routine, event = ctypes.windll.kernelbase.CtrlRoutine, EVENTS[what]
    ctypes.windll.kernel32.CreateThread(
        None, 0, routine, ctypes.c_void_p(event), 0, None
    )

EVENTS = {"break": 1, "close": 2, "log-off": 5}
what = sys.argv[1]
threading.Thread(target=act, daemon=True).start()
sys.exit(main(sys.argv[2:]))
"""
ROBOTS = """\
[experiment]
name = "lab"
dt = "50 ms"
duration = "60 s"
pace = 1.0

[[robot]]
name = "sim"
definition = "woodbot"
driver = "kinematic"

[[output]]
name = "log"
type = "csv"
"""
#: holds the arrow up in its console, which Wine's terminal cannot: there each key is
#: released at once.  Source: Microsoft's documentation of INPUT_RECORD
HOLDS = """\
import ctypes, struct, sys, threading
from rems_net.cli import main

def hold():
    windows = ctypes.windll.kernel32
    windows.GetStdHandle.restype = ctypes.c_void_p
    console = ctypes.c_void_p(windows.GetStdHandle(-10))
    key_event, down, repeats, up_arrow = 1, 1, 1, 0x26
    record = struct.pack("<HxxiHHHHI", key_event, down, repeats, up_arrow, 0, 0, 0)
    while not threading.Event().wait(0.2):
        windows.WriteConsoleInputW(console, record, 1, ctypes.byref(ctypes.c_uint()))

threading.Thread(target=hold, daemon=True).start()
sys.exit(main(sys.argv[1:]))
"""


ASKS = """\
from rems_net.teleop.windows import WindowsConsole
print("asked:", WindowsConsole().ask({"w", "up", "shift", "\u00df", "."}))
"""


def left(windows: Windows) -> list[str]:
    """Return the programs with Python that still run in Windows."""
    listed = windows.run("tasklist").splitlines()
    return [line for line in listed if "python" in line.lower()]


@pytest.mark.parametrize("way", ["ctrl+c", "break", "close", "log-off"])
def test_an_end_that_a_person_makes(windows: Windows, tmp_path: Path, way: str) -> None:
    (tmp_path / "lab.toml").write_text(ROBOTS, encoding="utf-8")
    (tmp_path / "around.py").write_text(AROUND, encoding="utf-8")
    rems = ["run", "lab.toml"]
    words = ["-m", "rems_net", *rems] if way == "ctrl+c" else ["around.py", way, *rems]
    with console(windows, tmp_path, windows.exe, "-W", "error", *words) as shown:
        if way == "ctrl+c":
            shown.wait_for(r"[1-9]\.\d s of 60")
            shown.type("\x03")
        status = shown.status(60.0)
    assert status == 130, shown.text
    assert re.search(r"Interrupted after tick \d+", shown.text), shown.text
    assert not left(windows)
    folder = tmp_path / "runs" / "lab"
    rows = (folder / "sim.csv").read_bytes()
    assert rows.endswith(b"\n")
    assert rows.count(b"\n") > 10
    assert (folder / "run.mcap").read_bytes().endswith(MAGIC)


def test_a_robot_is_driven_by_the_keys_of_a_console(
    windows: Windows, tmp_path: Path
) -> None:
    (tmp_path / "lab.toml").write_text(ROBOTS, encoding="utf-8")
    (tmp_path / "holds.py").write_text(HOLDS, encoding="utf-8")
    with windows.begin("run", "lab.toml", cwd=tmp_path) as run:
        assert run.stdout is not None
        line = next(line for line in run.stdout if "fabric at" in line)
        at = line.split()[-1].rstrip(".")
        words = ["holds.py", "drive", "robot/sim", "--at", at]
        with console(windows, tmp_path, windows.exe, *words) as shown:
            shown.wait_for("robot/sim")
            until(lambda: moved(tmp_path / "runs" / "lab" / "sim.csv"))
            shown.type("\x03")
            shown.status()
        run.kill()


def test_it_is_asked_whether_keys_are_down(windows: Windows, tmp_path: Path) -> None:
    """None is here: those of any keyboard, with names of one letter that are two."""
    (tmp_path / "asks.py").write_text(ASKS, encoding="utf-8")
    with console(windows, tmp_path, windows.exe, "asks.py") as shown:
        shown.wait_for("asked: False")
        assert shown.status() == 0


def moved(log: Path) -> bool:
    """Return whether the robot of a recording has left its place."""
    if not log.exists():
        return False
    header, *rows = log.read_text(encoding="utf-8").splitlines()
    at = header.split(",").index("state/x [m]")
    return len(rows) > 1 and float(rows[-1].split(",")[at]) > 0.01


def test_a_typed_line_stops_all_robots(windows: Windows, tmp_path: Path) -> None:
    listen = ["--listen", f"tcp/127.0.0.1:{free_port()}", "--no-qr"]
    words = ["-m", "rems_net", "router", "serve", *listen]
    with console(windows, tmp_path, windows.exe, *words) as shown:
        shown.wait_for("To stop all robots, type here")
        shown.type("x\bs\r")
        shown.wait_for("On rems:")
        shown.type("\x03")
        assert shown.status() == 0
