"""Ray in lock-step: N actors, one `ray.get` of all their states per tick."""

from __future__ import annotations

import json
import logging
import os
import sys
import time
from typing import Any

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
os.environ["RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO"] = "0"

# It reads the environment when it is imported.
import ray  # type: ignore[import-untyped,import-not-found,unused-ignore]


class Agent:
    """One actor: a state of four numbers for every tick."""

    def step(self, n: int, t: float) -> dict[str, float]:
        return {"x": t, "y": 0.0, "heading": 0.0, "speed": 0.0}


def tick(agents: int, ticks: int) -> float:
    """Tick, wait for all states, tick again. Returns ticks per second."""
    ray.init(
        num_cpus=agents + 1,
        include_dashboard=False,
        log_to_driver=False,
        logging_level=logging.ERROR,
    )
    actors: list[Any] = [ray.remote(Agent).remote() for _ in range(agents)]
    warm = ticks // 5
    for n in range(1, ticks + 1):
        if n == warm + 1:
            begun = time.perf_counter()
        ray.get([actor.step.remote(n, n * 0.01) for actor in actors])
    seconds = time.perf_counter() - begun
    ray.shutdown()
    return (ticks - warm) / seconds


def main() -> None:
    print(json.dumps({"rate": tick(int(sys.argv[1]), int(sys.argv[2]))}))


if __name__ == "__main__":
    main()
