"""A sweep on clusters of two nodes, one of which is killed half-way."""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net import sweep
from rems_net.errors import ExperimentError
from rems_net.sweeps.on_dask import dask_executor
from rems_net.sweeps.on_ray import RayExecutor
from tests.agents.runs import free_port, until
from tests.commands import environment
from tests.sweeps.labs import lab, written

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
#: a run of about a tenth of a second
LONG, RUNS = "20 s", 16
HERE = "tcp://127.0.0.1"


@contextmanager
def halfway(out: Path, kill: Any) -> Iterator[None]:
    """Kill a node once a quarter of the runs are there."""

    def look() -> None:
        until(lambda: len([*out.glob("0*")]) >= RUNS // 4, 60)
        kill()

    thread = threading.Thread(target=look)
    thread.start()
    yield
    thread.join()


def check(out: Path, swept: Any, alone: Any) -> None:
    """Every run is there once, and each row is that of one worker here."""
    numbers = Counter(json.loads(p.read_text())[0] for p in out.glob("*/row.json"))
    assert numbers == dict.fromkeys(range(1, RUNS + 1), 1)
    assert not swept.failed
    assert swept.csv() == alone.csv()


@contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Run a program of the cluster, in a process group of its own."""
    process = subprocess.Popen(
        [sys.executable, "-m", *words],
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        kill(process)


def kill(process: subprocess.Popen[str]) -> None:
    """End a program and all that it has started."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def test_dask(tmp_path: Path) -> None:
    reason = "distributed is not installed (an extra)"
    pytest.importorskip("distributed", reason=reason)
    made = lab(tmp_path / "lab", LONG)
    alone = sweep(made, seeds=RUNS, out=tmp_path / "alone", workers=1)
    port, out = str(free_port()), tmp_path / "s"
    at = f"{HERE}:{port}"
    node = ("distributed.cli.dask_worker", at, "--nworkers", "1", "--nthreads", "1")
    where = ("--no-dashboard", "--local-directory", str(tmp_path))
    head = (
        "distributed.cli.dask_scheduler",
        "--no-dashboard",
        "--host",
        HERE,
        "--port",
        port,
    )
    with (
        started(*head),
        started(*node, *where) as first,
        started(*node, *where),
        dask_executor(at) as executor,
    ):
        client: Any = importlib.import_module("distributed").get_client()
        client.wait_for_workers(2, timeout=60)
        with halfway(out, lambda: kill(first)):
            swept = sweep(made, seeds=RUNS, out=out, executor=executor)
        assert len(client.scheduler_info()["workers"]) == 1
    check(out, swept, alone)


def test_ray(tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="ray is not installed (an extra)")
    made = lab(tmp_path / "lab", LONG)
    alone = sweep(made, seeds=RUNS, out=tmp_path / "alone", workers=1)
    cluster: Any = importlib.import_module("ray.cluster_utils").Cluster()
    out = tmp_path / "s"
    try:
        cluster.add_node(num_cpus=1, include_dashboard=False)
        second = cluster.add_node(num_cpus=1)
        with RayExecutor(cluster.address) as executor:
            leave = halfway(out, lambda: cluster.remove_node(second, False))
            with leave:
                swept = sweep(made, seeds=RUNS, out=out, executor=executor)
            ray: Any = importlib.import_module("ray")
            # A quick sweep is over before Ray has noticed that the node is gone.
            until(lambda: sum(node["Alive"] for node in ray.nodes()) == 1, 60)
    finally:
        cluster.shutdown()
    check(out, swept, alone)


def test_a_node_with_another_source(tmp_path: Path) -> None:
    """A worker of Dask in whose folder a class was edited is refused."""
    distributed = pytest.importorskip(
        "distributed", reason="distributed is not installed (an extra)"
    )
    written(tmp_path / "lab")
    made = lab(tmp_path / "lab", LONG)
    cluster: Any = distributed.LocalCluster(
        1, threads_per_worker=1, dashboard_address=None
    )
    source = tmp_path / "lab" / "swept.py"
    out = tmp_path / "s"

    def edit() -> None:
        source.write_text(source.read_text() + "# edited\n")

    refuses = pytest.raises(ExperimentError)
    at = cluster.scheduler_address
    with cluster, dask_executor(at) as executor, halfway(out, edit), refuses as refused:
        sweep(made, seeds=RUNS, out=out, executor=executor)
    assert "swept.py differs there and on" in str(refused.value)
