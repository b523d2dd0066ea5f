"""`rems run --json`: what happens and the report, one JSON object a line."""

import json
from pathlib import Path
from typing import Any

import pytest

from rems_net.cli import main
from tests.commands import Run

SCRIPT = """\
from rems_net import Experiment, Input, Out, Schema
from rems_net.defdict import percent


class Stick(Input):
    value = Out(Schema("stick", {"wheel": {"left": percent(), "right": percent()}}))
    spare = Out(Schema("spare", {"left": percent()}))

    def read(self, tick):
        if tick.n == 3:
            print("three", end="")
        if tick.n == 5 and not self.restarts:
            raise ValueError("out of reach")
        self.value["wheel/left"] = 60


if __name__ == "__main__":
    lab = Experiment("lab", duration="1 s")
    lab.input("stick", Stick, restart=1)
    for name in ("a", "b"):
        more = {"command": "input/stick/value", "host": "here"}
        lab.robot(name, "woodbot", "kinematic", **more)
    lab.output("log", "csv", host="here")
    print("from the script")
    lab.run()
"""


def lines(text: str) -> list[dict[str, Any]]:
    found = [json.loads(line) for line in text.splitlines()]
    return [one for one in found if one["kind"] not in ("held", "late")]


def test_a_program_reads_a_run(folder: Path, program: Run) -> None:
    (folder / "lab.py").write_text(SCRIPT, encoding="utf-8")
    done = program("run", "lab.py", "--json")
    assert (done.returncode, done.stderr) == (0, "from the script\n")
    begun, *events, report = lines(done.stdout)
    assert begun["kind"] == "begun"
    assert begun["text"].startswith("fabric at tcp/127.0.0.1:")
    found = {one["kind"]: one for one in events}
    assert found.keys() == {"printed", "crashed", "back", "unset"}
    assert found["printed"] == {
        "level": "info",
        "tick": 0,
        "agent": "input/stick",
        "kind": "printed",
        "text": "three",
    }
    for kind in ("crashed", "back"):
        told = {name: found[kind][name] for name in ("level", "tick", "agent")}
        assert told == {"level": "info", "tick": 5, "agent": "input/stick"}
    assert "ValueError: out of reach" in found["crashed"]["text"]
    unset = found["unset"]
    assert (unset["level"], unset["agent"]) == ("warning", "input/stick")
    assert unset["text"].startswith("input/stick never set 'spare'")
    assert (report["level"], report["kind"], report["tick"]) == ("info", "report", 10)
    made = ("a.csv", "b.csv", "run.mcap")
    assert report["files"] == [str(folder / "runs/lab" / name) for name in made]
    (pair,) = report["pairs"]
    assert (pair["a"], pair["b"], pair["rms"], pair["parted"]) == ("a", "b", 0, None)


def test_a_mistake_is_the_last_event(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "none.toml", "--json"]) == 2
    said = capsys.readouterr()
    (event,) = lines(said.out)
    assert (event["level"], event["kind"]) == ("error", "failed")
    assert said.err == f"rems: {event['text']}\n"
