"""What `rems` says of a mistake, in this process: one sentence, and nothing is left."""

from pathlib import Path

import pytest

from rems_net.cli import main
from rems_net.errors import uncoded

#: of which part of the `lab.toml` of these tests a sentence speaks
MODEL = 'lab.toml, [[robot]] "model": '
INPUT = 'lab.toml, [[input]] "keys": '


def complaint(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    assert main(args) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("rems: ")
    assert not (Path.cwd() / "runs").exists()
    return uncoded(said.err.removeprefix("rems: ").rstrip("\n"))
