"""A Create 2, which has no watchdog, and a run whose terminal or laptop goes."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from tests.agents.runs import relatives, until
from tests.drivers.hardware.create2.scene import emulated, wheels

LAB = """\
experiment = { name = "lab", dt = "50 ms", duration = "60 s", pace = 1 }
input = [{ name = "keys", type = "csv", options.file = "keys.csv" }]

[[robot]]
name = "real"
definition = "create2"
driver = "create2"
command = "input/keys"
options = { port = "port" }
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
60.0,5.0,4.0
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_ctrl_z_and_a_laptop_that_shuts_down(tmp_path: Path) -> None:
    """Who drives is not of the terminal; told to end, it has the robot stand first."""
    (tmp_path / "lab.toml").write_text(LAB)
    (tmp_path / "keys.csv").write_text(KEYS)
    mark = f"ENDED_MARK={tmp_path}"
    with emulated(tmp_path) as emulator:
        (tmp_path / "port").symlink_to(emulator.where)
        process = subprocess.Popen(
            [sys.executable, "-m", "rems_net", "run", "lab.toml"],
            cwd=tmp_path,
            env=os.environ | dict([mark.split("=", 1)]),
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            until(lambda: wheels(emulator) == (180, 144))
            os.killpg(process.pid, signal.SIGSTOP)  # as Ctrl+Z does
            until(lambda: wheels(emulator) == (0, 0))
            os.killpg(process.pid, signal.SIGCONT)
            until(lambda: wheels(emulator) == (180, 144))
            for sign in (signal.SIGTERM, signal.SIGHUP):  # as systemd does
                for one in relatives(mark):
                    with suppress(ProcessLookupError):
                        os.kill(one, sign)
            until(lambda: wheels(emulator) == (0, 0))
            assert process.wait(20) == 130
        finally:
            process.kill()
            process.wait()
        until(lambda: not relatives(mark))
