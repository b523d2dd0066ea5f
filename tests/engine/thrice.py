"""One experiment in the engine, in one host and in several."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rems_net import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE


def in_three_ways(
    build: Callable[[dict[str, Any]], Experiment], *names: str
) -> dict[str, bytes]:
    """Return what the engine records, once one host and three have recorded the same.

    The one is no process. tests/engine/test_law.py has a process for each agent.
    """
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for way in ("engine", "one", "three"):
            lab = build({"host": HERE})
            if way == "three":
                for i, plan in enumerate(lab.plans.values()):
                    plan.host = f"h{i % 3}"
            out = Path(folder, way)
            lab.run(out, direct=way == "engine", show=Show())
            found[way] = {name: (out / name).read_bytes() for name in names}
    assert found["engine"] == found["one"] == found["three"]
    return found["engine"]
