"""Watchers: pages without a browser, which count the frames that they receive.

`python watchers.py LINK COUNT` prints `open` for each page, and once all are
closed the counts as JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
from urllib.parse import urlsplit

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed


async def watch(link: str) -> int:
    """Look at a page until it closes; return how many frames came."""
    parts = urlsplit(link)
    frames = 0
    async with connect(
        f"ws://{parts.netloc}/",
        origin=f"http://{parts.netloc}",  # type: ignore[arg-type]
        compression=None,
        max_size=None,
        ping_interval=None,
    ) as socket:
        print("open", flush=True)
        await socket.send(json.dumps({"hello": parts.fragment, "version": 1}))
        try:
            async for message in socket:
                frames += isinstance(message, bytes)
        except ConnectionClosed:
            pass
    return frames


async def main(link: str, count: int) -> None:
    counts = await asyncio.gather(*(watch(link) for _ in range(count)))
    print(json.dumps(counts, separators=(",", ":")), flush=True)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2])))
