"""The page watches and takes no part: a run has the same bytes with and without it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from benchmarks.programs.page import browsers
from tests.agents.runs import PARTS
from tests.commands import command, environment, link_of
from tests.signals import freeze

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("law", dt=0.02, duration="20 s", folder={str(PARTS)!r})
lab.input("wave", "parts.py:Wave")
lab.robot("cart", "parts.py:Cart", "parts.py:Euler", command="input/wave")
lab.output("log", "csv")
lab.run("out")
"""


@pytest.mark.slow
def test_thirty_pages_and_a_frozen_one_change_no_byte(tmp_path: Path) -> None:
    folders = [tmp_path / "alone", tmp_path / "watched"]
    for folder in folders:
        folder.mkdir()
        (folder / "law.py").write_text(SCRIPT, encoding="utf-8")
    run = command("run", "law.py")
    subprocess.run(
        run, cwd=folders[0], env=environment(), check=True, capture_output=True
    )

    process = subprocess.Popen(
        [*run, "--pace", "1", "--dashboard"],
        cwd=folders[1],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )
    looking = []
    try:
        link = urlsplit(link_of(process))
        for count in (1, 30):
            looking.append(browsers(link.netloc, link.fragment, count, 3.0))
        frozen = looking[0]
        assert frozen.stdout is not None
        assert frozen.stdout.readline() == b"begun\n"
        freeze(frozen.pid)
        found = json.loads(looking[1].communicate(timeout=60)[0].split(b"\n")[1])
        assert found["frames"] > 3
        assert found["behind"] <= 2  # no other page loses a frame
        assert process.wait(60) == 0, process.communicate()[0]
    finally:
        process.kill()
        process.communicate()
        for one in looking:
            one.kill()
            one.communicate()

    alone, watched = (
        {f.name: f.read_bytes() for f in folder.glob("out/*.csv")} for folder in folders
    )
    assert len(alone) == 1
    assert alone == watched
