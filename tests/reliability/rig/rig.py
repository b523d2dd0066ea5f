"""Rig: machines, links and programs that are all gone when it ends.

with Rig(folder) as rig:
    rig.connect("hub", "bot")
    router, endpoint = rig.router("hub")
    rig.rems("run", "lab.toml", machine="bot", router=endpoint)
    rig.link("bot", "hub", delay=0.02, jitter=0.01, loss=0.02)
    rig.cut("bot")

Without `connect` everything is on this machine, over its loopback, and needs no root.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import pytest

from tests.agents.runs import free_port
from tests.reliability.rig.keeper import marked
from tests.reliability.rig.programs import Program, send

ROOT = Path(__file__).parents[3]
PORT = 7447
#: what the machine on which everything is, without namespaces, is called
HERE = "here"


def missing() -> str:
    """What is missing here to build machines out of namespaces; empty if nothing."""
    if not sys.platform.startswith("linux"):
        return "network namespaces are Linux's"
    if os.geteuid() != 0:
        return "network namespaces need root"
    for what in ("/dev/net/tun", "/proc/self/ns/net"):
        if not Path(what).exists():
            return f"there is no {what}: the kernel has no TUN devices or namespaces"
    if shutil.which("nsenter") is None:
        return "there is no nsenter (package util-linux)"
    return ""


#: marks of tests on several machines
MACHINES = [
    pytest.mark.slow,
    pytest.mark.root,
    pytest.mark.timeout(400),
    pytest.mark.skipif(bool(missing()), reason=missing()),
]


class Rig:
    """Programs on one or more machines. Use it by `with`."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.mark = f"RIG_MARK={uuid.uuid4().hex}"
        self.programs: list[Program] = []
        self.addresses: dict[str, str] = {HERE: "127.0.0.1"}
        self._enter: dict[str, list[str]] = {HERE: []}
        self._bridge: subprocess.Popen[str] | None = None

    # -- life --------------------------------------------------------------------

    def __enter__(self) -> Self:
        self.folder.mkdir(parents=True, exist_ok=True)
        # A user's own runtime folder: short, since sockets may be made in it.
        self.runtime = Path(tempfile.mkdtemp(prefix="rig-"))
        self._keeper = subprocess.Popen(
            [
                *(sys.executable, "-m", "tests.reliability.rig.keeper"),
                *(self.mark, str(self.runtime)),
            ],
            stdin=subprocess.PIPE,
            cwd=ROOT,
        )
        return self

    def __exit__(self, *_: object) -> None:
        """The keeper ends all, as it does when this process is killed."""
        assert self._keeper.stdin is not None
        self._keeper.stdin.close()
        failed = self._keeper.wait()
        for program in self.programs:
            program.end()
        if self._bridge is not None:
            self._bridge.communicate()
        assert not failed, f"these processes could not be ended: {marked(self.mark)}"

    # -- machines and links --------------------------------------------------------

    def connect(self, *names: str) -> None:
        """Make machines with these names, each linked with each other."""
        given = {name: f"10.77.0.{i}" for i, name in enumerate(names, 1)}
        self._bridge = subprocess.Popen(
            [
                *(sys.executable, "-m", "tests.reliability.rig.bridge"),
                *(f"{name}={address}" for name, address in given.items()),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self._environment(),
            cwd=ROOT,
        )
        for name, (net, host) in self._hear().items():
            self._enter[name] = ["nsenter", f"--net={net}", f"--uts={host}", "--"]
        self.addresses.update(given)

    def _hear(self) -> dict[str, Any]:
        assert self._bridge is not None
        assert self._bridge.stdout is not None
        said: dict[str, Any] = json.loads(self._bridge.stdout.readline() or "{}")
        if "error" in said:
            raise RuntimeError(f"the bridge: {said['error']}")
        return said

    def change(
        self, source: str, target: str, /, **what: float
    ) -> dict[str, list[int]]:
        """Set delay, jitter [s], loss [0 to 1], rate [bit/s] or cut of one direction.

        "*" stands for every machine. Returns what each link has passed and lost.
        """
        return self._ask({"from": source, "to": target, **what})

    def move(self, machine: str, address: str) -> None:
        """Give a machine another address, as DHCP does, while programs run there."""
        self._ask({"machine": machine, "address": address})
        self.addresses[machine] = address

    def _ask(self, what: dict[str, Any]) -> dict[str, Any]:
        assert self._bridge is not None, "there are no links without `connect`"
        assert self._bridge.stdin is not None
        self._bridge.stdin.write(json.dumps(what) + "\n")
        self._bridge.stdin.flush()
        return self._hear()

    def link(self, one: str, other: str = "*", /, **what: float) -> None:
        """The same for both directions."""
        self.change(one, other, **what)
        self.change(other, one, **what)

    def cut(self, one: str, other: str = "*", *, one_way: bool = False) -> None:
        """Cut all that `one` sends to `other`, and what comes back."""
        self.change(one, other, cut=True)
        if not one_way:
            self.change(other, one, cut=True)

    def heal(self, one: str = "*", other: str = "*") -> None:
        """Undo `cut`; without names, every one."""
        self.link(one, other, cut=False)

    def drop(self, machine: str, other: str, *, undo: bool = False) -> None:
        """Have `machine` drop what comes from `other`, as a firewall does (iptables).

        Unlike a cut this is inside of the machine: nothing is lost on the way.
        """
        what = "--delete" if undo else "--append"
        rule = ["INPUT", "--source", self.addresses[other], "--jump", "DROP"]
        command = [*self._enter[machine], "iptables", "--wait", what, *rule]
        subprocess.run(command, check=True, env=self._environment(machine))

    def _environment(self, machine: str = HERE) -> dict[str, str]:
        """The environment of a program: its mark, and folders of its own."""
        runtime = self.runtime / machine
        runtime.mkdir(mode=0o700, exist_ok=True)
        kept = {k: v for k, v in os.environ.items() if k not in ("REMS_ROUTER",)}
        name, _, value = self.mark.partition("=")
        path = os.pathsep.join(filter(None, [str(ROOT), kept.get("PYTHONPATH")]))
        return {
            **kept,
            name: value,
            "RIG_MACHINE": machine,
            "XDG_RUNTIME_DIR": str(runtime),
            "XDG_CONFIG_HOME": str(runtime / "config"),
            "PYTHONPATH": path,
            "PYTHONUNBUFFERED": "1",
            "COLUMNS": "300",  # a sentence is a line
        }

    # -- programs ------------------------------------------------------------------

    def start(
        self, name: str, argv: Sequence[str], machine: str = HERE, router: str = ""
    ) -> Program:
        """Start a program on a machine; `router` is what it finds in REMS_ROUTER."""
        environment = self._environment(machine)
        if router:
            environment["REMS_ROUTER"] = router
        log = self.folder / f"{name}-{len(self.programs)}.log"
        program = Program(name, [*self._enter[machine], *argv], environment, log)
        self.programs.append(program)
        return program

    def module(
        self, module: str, *words: object, machine: str = HERE, router: str = ""
    ) -> Program:
        """Start `python -m module words...`, with the last part as its name."""
        argv = [sys.executable, "-m", module, *map(str, words)]
        return self.start(module.rpartition(".")[2], argv, machine, router)

    def router(self, machine: str = HERE, endpoint: str = "") -> tuple[Program, str]:
        """Start a router, at an endpoint that it had before or a new one."""
        port = PORT if self._enter[machine] else free_port()
        endpoint = endpoint or f"tcp/{self.addresses[machine]}:{port}"
        program = self.module("rems_net.router", "--listen", endpoint, machine=machine)
        program.wait_for("^Router at ")
        return program, endpoint

    def rems(self, *words: object, machine: str = HERE, router: str = "") -> Program:
        """Start `rems words...`: a run, agents that join one, a question."""
        return self.module("rems_net", *words, machine=machine, router=router)

    def machine(self, name: str) -> list[int]:
        """The processes on a machine."""
        mine = f"RIG_MACHINE={name}"
        return [pid for pid in marked(self.mark) if pid in set(marked(mine))]

    def freeze(self, name: str) -> None:
        """Put a whole machine to sleep, as a closed lid does."""
        for pid in self.machine(name):
            send(pid, signal.SIGSTOP)

    def thaw(self, name: str) -> None:
        for pid in self.machine(name):
            send(pid, signal.SIGCONT)
