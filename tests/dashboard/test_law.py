"""The page watches and takes no part: a run has the same bytes with and without it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents.runs import PARTS
from tests.commands import command, environment, link_of

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("law", dt=0.02, duration="3 s", folder={str(PARTS)!r})
lab.input("wave", "parts.py:Wave")
lab.robot("cart", "parts.py:Cart", "parts.py:Euler", command="input/wave")
lab.output("log", "csv")
lab.run("out")
"""
WATCHERS = Path(__file__).with_name("watchers.py")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="nothing freezes here")
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
        text=True,
    )
    watchers = []
    try:
        link = link_of(process)
        for count in (30, 1):
            words = [sys.executable, str(WATCHERS), link, str(count)]
            watchers.append(subprocess.Popen(words, stdout=subprocess.PIPE, text=True))
        frozen = watchers[1]
        assert frozen.stdout is not None
        assert frozen.stdout.readline() == "open\n"
        os.kill(frozen.pid, signal.SIGSTOP)
        assert process.wait(60) == 0, process.communicate()[0]
        counts = json.loads(watchers[0].communicate(timeout=20)[0].split()[-1])
        assert len(counts) == 30
        assert min(counts) > 10
        assert max(counts) - min(counts) <= 2  # no other page loses a frame
    finally:
        process.kill()
        process.communicate()
        for one in watchers:
            one.kill()
            one.communicate()

    alone, watched = (
        {f.name: f.read_bytes() for f in folder.glob("out/*.csv")} for folder in folders
    )
    assert len(alone) == 1
    assert alone == watched
