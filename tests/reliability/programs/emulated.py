"""A device of `rems board emulate`, and when it begins to move and stands still.

`python -m tests.reliability.programs.emulated LOG create2`

Its first line, and the lines in LOG, are those of `device.py`. Why: `watchdog` for one
that stopped by its own, else `told`.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

from rems_net.drivers.hardware.dynamixel import table
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.known import emulated
from rems_net.emulators.websocket import WebSocketPort
from rems_net.emulators.woodbot_websocket import OriginalWoodbot

#: s. Between two looks at its wheels
LOOK = 0.002


def _create2(device: Any) -> tuple[bool, str]:
    return bool(device.body.left or device.body.right), "told"


def _dynabot(device: Any) -> tuple[bool, str]:
    servos = (device.left, device.right)
    tripped = any(servo.memory[table.WATCHDOG] < 0 for servo in servos)
    return any(s.radians for s in servos), "watchdog" if tripped else "told"


def _woodbot(device: Any) -> tuple[bool, str]:
    return device.driven[-1:] not in ([], [(90, 90)]), "told"


#: whether it moves, and what stopped it if it stands
LOOKS: dict[str, Callable[[Any], tuple[bool, str]]] = {
    "create2": _create2,
    "dynabot": _dynabot,
    "woodbot-ws": _woodbot,
}


def obey(emulator: Any) -> None:
    """Let happen what each line of the standard input says, such as `unplug 3`."""
    for line in sys.stdin:
        emulator.order(line.strip())


def main() -> None:
    path, name = Path(sys.argv[1]), sys.argv[2]
    with suppress(PermissionError, AttributeError):
        # A device has a computer of its own, which is never busy with other things.
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    made: Any = emulated(name, f"{path}.port") if name != "woodbot-ws" else None
    made = made or Emulator(OriginalWoodbot(), WebSocketPort())  # at a free port
    moved = False
    with made as emulator, path.open("w", encoding="utf-8") as log:
        print(json.dumps({"ports": [emulator.where]}), flush=True)
        Thread(target=obey, args=(emulator,), daemon=True).start()
        while emulator.failure is None:
            moves, why = LOOKS[name](emulator.device)
            if moves != moved:
                moved = moves
                line = {"robot": 0, "moves": moves, "why": "told" if moves else why}
                line |= {"monotonic": time.monotonic()}
                print(json.dumps(line), file=log, flush=True)
            Event().wait(LOOK)


if __name__ == "__main__":
    main()
