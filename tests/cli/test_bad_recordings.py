"""Recordings that are damaged, foreign or of another time: one sentence each."""

import importlib
import json
from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import Schema
from rems_net.cli import main
from rems_net.defdict import angle, canonical, cdr, length
from rems_net.packing import pack, unpack
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.writer import SCHEMA, McapWriter
from tests.commands import inside

STATE = Schema("state", {"x": length(), "y": length(), "heading": angle()})
#: verbs that read a recording
READERS = ("info", "plot", "compare", "export", "animate", "rerun", "replay")
#: an agent of an experiment, with a class of this name
AGENTS = {"process": [{"name": "p", "type": ""}]}


def write(path: Path, **about: Any) -> Path:
    """A recording of two robots."""
    file = McapWriter(path)
    told = {"experiment": "lab", "dt": 0.1, "ticks": 30, **about}
    file.open({key: json.dumps(value) for key, value in told.items()})
    keys = [f"robot/{name}/{port}" for name in "ab" for port in ("command", "state")]
    file.declare(dict.fromkeys(keys, STATE))
    for n in range(1, 31):
        state = cdr(STATE).encode(STATE({"x": n / 7, "y": 0.0, "heading": -n}))
        file.add(n, n * 10**8, dict.fromkeys(keys, state))
        file.end_tick()
    file.close()
    return path


def foreign(path: Path, *channels: tuple[str, str, str, bytes]) -> Path:
    """A file of another program: topic, encoding, and a schema's encoding and data."""
    writer: Any = importlib.import_module("mcap.writer")
    with path.open("wb") as stream:
        made = writer.Writer(stream, compression=writer.CompressionType.NONE)
        made.start()
        for topic, encoding, kind, data in channels:
            schema = made.register_schema(topic, kind, data)
            one = made.register_channel(topic, encoding, schema)
            made.add_message(one, log_time=1, data=b"{}", publish_time=1)
        made.finish()
    return path


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    status = main([*words])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return status, out, err


@pytest.mark.parametrize("verb", READERS)
@pytest.mark.parametrize("how", ["empty", "text", "crc", "cut at once"])
def test_damaged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str, how: str
) -> None:
    path = write(tmp_path / "run.mcap")
    data = bytearray(path.read_bytes())
    at = McapFile(path).chunks[1].at
    if how == "crc":
        data[at + 60] ^= 1
    cut = {"empty": 0, "cut at once": 5}.get(how, len(data))
    replayed = (verb, how) == ("replay", "crc")  # found when the tick has come
    path.write_bytes(b"time [s]\n1\n" if how == "text" else data[:cut])
    status, _, err = said(capsys, verb, str(path))
    assert (status, len(err.splitlines())) == (1 if replayed else 2, 1), err
    assert "run.mcap" in err or "experiment" in err  # a rerun has no agents here


@pytest.mark.parametrize("verb", ["info", "export", "animate", "compare"])
def test_a_file_without_its_end_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    """Cut in its third chunk: what is before is there."""
    path = write(tmp_path / "run.mcap")
    third = McapFile(path).chunks[2]
    path.write_bytes(path.read_bytes()[: third.at + 80])
    status, _, err = said(capsys, verb, str(path))
    assert (status, err) == (0, "")
    if verb == "export":
        rows = (tmp_path / "export" / "a.csv").read_text(encoding="utf-8")
        assert 15 < len(rows.splitlines()) < 31


@pytest.mark.parametrize("verb", ["plot", "compare", "export"])
def test_a_file_without_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    """Cut before its first chunk; no list of nothing is offered."""
    path = write(tmp_path / "run.mcap")
    path.write_bytes(path.read_bytes()[: McapFile(path).chunks[0].at])
    status, _, err = said(capsys, verb, str(path))
    assert (status, len(err.splitlines())) == (2, 1), err
    assert "run.mcap has no values: the process that wrote it ended before" in err


@pytest.mark.parametrize("verb", READERS[1:])
def test_a_file_of_another_program(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    """Its channels are named where they are passed over, and by the sentence."""
    channels = [("/pose", "json", "jsonschema"), ("/scan", "protobuf", "protobuf")]
    path = foreign(tmp_path / "run.mcap", *((*one, b"{}") for one in channels))
    status, out, _ = said(capsys, "info", str(path))
    assert status == 0
    assert "passed over: /pose; its messages are 'json', not CDR" in out
    assert "passed over: /scan; its messages are 'protobuf', not CDR" in out
    status, _, err = said(capsys, verb, str(path))
    assert (status, len(err.splitlines())) == (2, 1), err


def test_a_schema_of_a_newer_version(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its channel is passed over, and named; the others are read."""
    found = unpack(canonical(STATE).to_wire(), longest_list=100, largest_map=16)
    newer = pack({**found, "rems": 7}).hex()
    file = McapWriter(tmp_path / "run.mcap")
    file.open({"experiment": '"lab"', "dt": "0.1"})
    file.channel("robot/b/state", "rems_msgs/msg/State", lambda: "", {SCHEMA: newer})
    file.declare({"robot/a/state": STATE})
    file.add(1, 10**8, {"robot/a/state": cdr(STATE).encode(STATE())})
    file.end_tick()
    file.close()
    status, out, err = said(capsys, "info", str(file.path))
    assert (status, err) == (0, "")
    assert "passed over: /robot/b/state; its schema cannot be read: " in out
    assert "format 7; this version of rems_net reads format 1" in out
    assert len(rems_net.read(file.path)["a"].seconds()) == 1


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("mine.py:Gone", "mine.py has no class 'Gone'"),
        ("nowhere.py:Gone", "There is no file"),
        (r"C:\lab\mine.py:P", r"C:\lab\mine.py:P is not below the folder"),
        (r"lab\mine.py:P", "There is no file"),
        ("rems_net.gone:P", "Cannot import 'rems_net.gone'"),
    ],
)
def test_a_class_that_is_gone(tmp_path: Path, name: str, says: str) -> None:
    (tmp_path / "mine.py").write_text("", encoding="utf-8")
    agents = {"process": [{"name": "p", "type": name}]}
    write(tmp_path / "run.mcap", agents=agents)
    done = inside("rerun", "run.mcap", folder=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done
    assert says in done.stderr
    assert "process/p cannot be made again" in done.stderr
