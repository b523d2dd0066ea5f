"""STOP of the page works while the clock is frozen: robots stand, and report it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import connect

from tests.agents.runs import free_port
from tests.commands import command, environment
from tests.signals import freeze, thaw

SCRIPT = """
from rems_net import Experiment
lab = Experiment("frozen", dt="20 ms", duration="600 s", pace=1, fabric="frozen")
lab.record = False
for name in ("a", "b"):
    lab.robot(name, "woodbot", "kinematic", host=name)
lab.run("out")
"""


def test_robots_stand_while_the_clock_is_frozen(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text(SCRIPT, encoding="utf-8")
    (tmp_path / "rt").mkdir(mode=0o700)
    at = f"tcp/127.0.0.1:{free_port()}"
    env = environment(XDG_RUNTIME_DIR=str(tmp_path / "rt"), REMS_ROUTER=at)
    with ExitStack() as stack:

        def start(words: list[str]) -> subprocess.Popen[str]:
            out = subprocess.PIPE
            process = subprocess.Popen(
                words, cwd=tmp_path, env=env, stdout=out, encoding="utf-8"
            )
            stack.callback(process.communicate)
            stack.callback(process.kill)
            return process

        start([sys.executable, "-m", "rems_net.router", "--listen", at])
        clock = start(command("run", "lab.py"))
        # its hosts end when it does, also if this test fails while it is frozen
        stack.callback(thaw, clock.pid)
        looking: Any = None
        while looking is None:  # until the run has a fabric to look at
            page = start(command("dashboard", "--no-qr", "--fabric", "frozen"))
            found = (re.search(r"http://\S+", line) for line in page.stdout or ())
            looking = next((one for one in found if one), None)
        link = urlsplit(looking.group())
        origin: Any = f"http://{link.netloc}"
        with connect(f"ws://{link.netloc}/", origin=origin, compression=None) as socket:
            socket.send(json.dumps({"hello": link.fragment, "version": 1}))

            def until(member: str, wanted: Any) -> Any:
                while True:
                    text = socket.recv(30)
                    found = json.loads(text) if isinstance(text, str) else {}
                    if member in found and wanted(found[member]):
                        return found[member]

            until("status", lambda status: len(status["agents"]) >= 2)
            freeze(clock.pid)
            socket.send(json.dumps({"do": "stop", "id": 1}))
            answer = until("answer", lambda _: True)
            for name in ("a", "b"):
                assert f"robot/{name} stands" in str(answer["result"])
