"""One experiment in the engine, in one host and in many."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rems_net import Experiment
from rems_net.agents.experiment.show import Show


def in_three_ways(
    build: Callable[[dict[str, Any]], Experiment], *names: str
) -> dict[str, bytes]:
    """What the engine records, once one host and many have recorded the same."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for way in ("engine", "one", "many"):
            lab = build({"host": "all"} if way == "one" else {})
            out = Path(folder, way)
            lab.run(out, direct=way == "engine", show=Show())
            found[way] = {name: (out / name).read_bytes() for name in names}
    assert found["engine"] == found["one"] == found["many"]
    return found["engine"]
