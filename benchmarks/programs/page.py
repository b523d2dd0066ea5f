"""The page of a fabric and its browsers; or a plain server that sends as many bytes.

`page ROBOTS CLIENTS SECONDS` starts a run of kinematic Woodbots at 50 Hz and as many
browsers, without pictures, and measures the server's process: CPU in percent of a core,
resident memory in MB, frames per second, bytes of a frame, and how many frames one
browser got less than another. `page ROBOTS CLIENTS SECONDS BYTES` is a server of
`websockets` that sends frames of so many bytes. `page ROBOTS CLIENTS SECONDS frozen`
has one browser more, which SIGSTOP freezes when it begins; *grown* is the memory since.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from subprocess import PIPE, Popen
from typing import Any

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, broadcast, serve

RATE = 30.0
#: s. Browsers look for so long before they are measured.
BEFORE = 3.0
#: how browsers connect: as real ones that do not ask for compression
WHOLE: dict[str, Any] = {"compression": None, "max_size": None, "ping_interval": None}


def resident() -> float:
    """Return this process's resident memory, MB; NaN where it is not known."""
    with suppress(OSError):
        text = Path("/proc/self/status").read_text(encoding="ascii")
        return float(text.partition("VmRSS:")[2].split()[0]) / 1024
    return float("nan")


async def look(link: str, token: str, count: int, seconds: float) -> None:
    """Be so many browsers; print how many frames and bytes came in these seconds."""
    frames, size = [0] * count, 0
    begun = False

    async def one(number: int) -> None:
        nonlocal size
        origin: Any = f"http://{link}"
        async with connect(f"ws://{link}/", origin=origin, **WHOLE) as socket:
            await socket.send(json.dumps({"hello": token, "version": 1}))
            async for message in socket:
                if begun and isinstance(message, bytes):
                    frames[number] += 1
                    size += len(message)

    tasks = [asyncio.create_task(one(number)) for number in range(count)]
    await asyncio.sleep(BEFORE)
    print("begun", flush=True)
    begun = True
    await asyncio.sleep(seconds)
    begun = False
    words = {
        "frames": sum(frames) / count / seconds,
        "bytes": size / max(1, sum(frames)),
        "behind": max(frames) - min(frames),
    }
    print(json.dumps(words), flush=True)
    for task in tasks:
        task.cancel()


def browsers(link: str, token: str, count: int, seconds: float) -> Popen[bytes]:
    """Start a process with so many browsers."""
    words = [sys.executable, "-m", "benchmarks.programs.page", "look"]
    words += [link, token, str(count), str(seconds)]
    return Popen(words, stdout=PIPE)


async def measured(
    link: str, token: str, count: int, seconds: float, to_freeze: Any = None
) -> dict[str, Any]:
    """Measure this process while so many browsers look at its server.

    to_freeze: a process with one more browser, which freezes as this begins.
    """
    with browsers(link, token, count, seconds) as looking:
        assert looking.stdout is not None
        await asyncio.to_thread(looking.stdout.readline)
        if to_freeze is not None:
            os.kill(to_freeze.pid, signal.SIGSTOP)
        memory = resident()
        cpu, wall = time.process_time(), time.perf_counter()
        await asyncio.sleep(seconds * 0.9)
        used = 100 * (time.process_time() - cpu) / (time.perf_counter() - wall)
        found = json.loads(await asyncio.to_thread(looking.stdout.readline))
    grown = resident() - memory
    return {"cpu": used, "memory": resident(), "grown": grown, **found}


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


def page(robots: int, count: int, seconds: float, freezes: bool) -> dict[str, Any]:
    """Measure the page of a run of so many robots; freezes: with a frozen browser."""
    # imported here: the plain server and the browsers do without
    from benchmarks.programs.shown import began
    from rems_net.dashboard.server import Server
    from rems_net.dashboard.serving import listening_at

    with ExitStack() as stack:
        fabric, _ = began(stack, robots)
        sock, door = stack.enter_context(listening_at("127.0.0.1", [0]))
        link = f"127.0.0.1:{door.port}"

        async def serving() -> dict[str, Any]:
            server = Server(fabric, door, RATE)
            async with await server.listen(sock):
                task = asyncio.create_task(server.run())
                to_freeze = None
                if freezes:
                    to_freeze = browsers(link, door.token, 1, 3600)
                    stack.callback(to_freeze.communicate)
                    stack.callback(to_freeze.kill)
                found = await measured(link, door.token, count, seconds, to_freeze)
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
        last = sys.argv[4] if len(sys.argv) > 4 else ""
        if last.isdecimal():
            result = asyncio.run(plain(how[1], how[2], int(last)))
        else:
            result = page(*how, last == "frozen")
        print(json.dumps(result))
