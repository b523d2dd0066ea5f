"""The page of a fabric and its browsers; or a plain server that sends as many bytes.

`page ROBOTS CLIENTS SECONDS` starts a run of kinematic Woodbots at 50 Hz and as many
browsers, without pictures, and measures the server's process: CPU in percent of a core,
resident memory in MB, frames per second, and bytes of a frame. `page ROBOTS CLIENTS
SECONDS BYTES` is a server of `websockets` that sends frames of so many bytes.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, broadcast, serve

RATE = 30.0
SCRIPT = """
from rems_net import Experiment
lab = Experiment("page", dt="20 ms", duration="600 s", pace=1, fabric="page")
for i in range({robots}):
    lab.robot(f"r{{i}}", "woodbot", "kinematic", host="robots")
lab.run("out")
"""


def resident() -> float:
    """Return this process's resident memory, MB; NaN where it is not known."""
    with suppress(OSError):
        text = Path("/proc/self/status").read_text(encoding="ascii")
        return float(text.partition("VmRSS:")[2].split()[0]) / 1024
    return float("nan")


async def look(link: str, token: str, count: int, seconds: float) -> None:
    """Be so many browsers; print how many frames and bytes came in these seconds."""
    frames = size = 0
    begun = False

    async def one() -> None:
        nonlocal frames, size
        origin: Any = f"http://{link}"
        async with connect(f"ws://{link}/", origin=origin, compression=None) as socket:
            await socket.send(json.dumps({"hello": token, "version": 1}))
            async for message in socket:
                if begun and isinstance(message, bytes):
                    frames += 1
                    size += len(message)

    tasks = [asyncio.create_task(one()) for _ in range(count)]
    await asyncio.sleep(3.0)
    print("begun", flush=True)
    begun = True
    await asyncio.sleep(seconds)
    begun = False
    words = {"frames": frames / count / seconds, "bytes": size / max(1, frames)}
    print(json.dumps(words), flush=True)
    for task in tasks:
        task.cancel()


async def measured(link: str, token: str, count: int, seconds: float) -> dict[str, Any]:
    """Measure this process while so many browsers look at its server."""
    words = [sys.executable, "-m", "benchmarks.programs.page", "look"]
    words += [link, token, str(count), str(seconds)]
    looking = await asyncio.create_subprocess_exec(*words, stdout=subprocess.PIPE)
    assert looking.stdout is not None
    await looking.stdout.readline()
    cpu, wall = time.process_time(), time.perf_counter()
    await asyncio.sleep(seconds * 0.9)
    used = 100 * (time.process_time() - cpu) / (time.perf_counter() - wall)
    found = json.loads(await looking.stdout.readline())
    await looking.wait()
    return {"cpu": used, "memory": resident(), **found}


async def plain(count: int, seconds: float, size: int) -> dict[str, Any]:
    """Measure a server that sends frames of so many bytes."""
    links: set[ServerConnection] = set()

    async def meet(link: ServerConnection) -> None:
        links.add(link)
        await link.wait_closed()
        links.discard(link)

    async def send() -> None:
        frame, due = bytes(size), time.monotonic()
        while True:
            due += 1 / RATE
            await asyncio.sleep(due - time.monotonic())
            broadcast(links, frame)

    async with serve(meet, "127.0.0.1", 0, compression=None) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        sending = asyncio.create_task(send())
        found = await measured(f"127.0.0.1:{port}", "", count, seconds)
        sending.cancel()
    return found


def page(robots: int, count: int, seconds: float) -> dict[str, Any]:
    """Measure the page of a run of so many robots."""
    from rems_net import join
    from rems_net.dashboard.server import Server
    from rems_net.dashboard.serving import listening_at
    from rems_net.errors import FabricError

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        # a runtime folder of its own, in which no other run is found
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        (folder / "lab.py").write_text(SCRIPT.format(robots=robots), encoding="utf-8")
        run = subprocess.Popen(
            [sys.executable, "lab.py"],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(run.wait)
        stack.callback(run.terminate)
        end = time.monotonic() + 60
        while True:
            try:
                fabric = stack.enter_context(join("page"))
                if len(fabric.agents()) >= robots:
                    break
            except FabricError:
                pass
            if time.monotonic() > end:
                raise SystemExit("the run does not begin")
            time.sleep(0.1)
        sock, door = stack.enter_context(listening_at("127.0.0.1", [0]))

        async def serving() -> dict[str, Any]:
            server = Server(fabric, door, RATE)
            async with await server.listen(sock):
                task = asyncio.create_task(server.run())
                link = f"127.0.0.1:{door.port}"
                found = await measured(link, door.token, count, seconds)
                task.cancel()
            return found

        return asyncio.run(serving())


if __name__ == "__main__":
    if sys.argv[1] == "look":
        asyncio.run(
            look(sys.argv[2], sys.argv[3], int(sys.argv[4]), float(sys.argv[5]))
        )
    else:
        how = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
        if len(sys.argv) > 4:
            result = asyncio.run(plain(how[1], how[2], int(sys.argv[4])))
        else:
            result = page(*how)
        print(json.dumps(result))
