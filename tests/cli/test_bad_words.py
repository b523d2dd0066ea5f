"""Every mistake on the command line is one sentence on stderr, and exit status 2."""

import os
from pathlib import Path

import pytest

from rems_net.cli import main
from rems_net.cli.verbs import NOUNS, RARE, VERBS
from rems_net.errors import uncoded
from tests.cli.complaint import complaint
from tests.commands import reason_of

KNOWN = ", ".join([*VERBS, *NOUNS, *RARE])

pytestmark = pytest.mark.usefixtures("nothing_starts")


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (
            ["run", "lab.tml"],
            "There is no file lab.tml in FOLDER. Did you mean 'lab.toml'?",
        ),
        (["run", "lab"], "There is no file lab in FOLDER. Did you mean 'lab.toml'?"),
        (
            ["run", "nowhere/x.toml"],
            "There is no file x.toml, nor its folder FOLDER/nowhere.",
        ),
        (
            ["run", "."],
            ". is a folder; expected an experiment file, such as lab.toml.",
        ),
        (
            ["run", "lab.toml", "--pace", "x"],
            "pace is 'x'; expected \"fast\" or a factor of real time, 0.001 to 10000, "
            "such as 1.0.",
        ),
        (
            ["run", "lab.toml", "--pace", "5e-324"],
            "pace is '5e-324'; expected \"fast\" or a factor of real time, 0.001 to "
            "10000, such as 1.0.",
        ),
        (
            ["run", "lab.toml", "--out", "keys.csv"],
            "lab.toml: cannot make the folder FOLDER/keys.csv: REASON.",
        ),
        (
            ["compare", "nowhere"],
            "There is no folder nowhere; expected the folder of a run, such as "
            "runs/demo.",
        ),
        (
            ["get", "robots/sim/state"],
            "'robots/sim/state' begins with 'robots'; a key begins with the fabric's "
            "name ('rems') or with one of input, robot, world, process, output, clock. "
            "Did you mean 'robot'?",
        ),
        (
            ["list"],
            "No fabric 'rems' is running on this machine. Start one with `rems run` "
            "or `rems demo --pace 1`, or go to that of a class with: rems router use "
            "ADDRESS",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_on_the_command_line(
    folder: Path, capsys: pytest.CaptureFixture[str], args: list[str], sentence: str
) -> None:
    if "REASON" in sentence:
        sentence = sentence.replace("REASON", reason_of((folder / "keys.csv").mkdir))
    assert complaint(capsys, *args) == sentence.replace(
        "FOLDER/", f"FOLDER{os.sep}"
    ).replace("FOLDER", str(folder))


def test_an_endpoint_that_is_none(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("REMS_ROUTER", "192.168.1.300")
    assert complaint(capsys, "list") == (
        "REMS_ROUTER: '192.168.1.300' is no address of a router; expected what `rems "
        "router serve` prints, such as tcp/192.168.1.20, a name such as lab-pc, or a "
        "code such as 30AG-08M6."
    )


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (
            ["lst"],
            f"rems has no verb 'lst'; it has {KNOWN}. Did you "
            "mean 'list'? Type: rems --help",
        ),
        (
            ["run"],
            "the following arguments are required: EXPERIMENT.toml. Type: rems run "
            "--help",
        ),
        (
            ["run", "lab.toml", "--sed", "3"],
            "rems run has no option '--sed'. Did you mean '--seed'? Type: rems run "
            "--help",
        ),
        (
            ["clock", "step", "1", "s"],
            "rems clock step has no place for 's'. Type: rems clock step --help",
        ),
        (
            ["set", "robot/sim/command"],
            f"rems has no verb 'set'; it has {KNOWN}. Did you "
            "mean: rems put robot/sim/command wheel/left=3? Type: rems --help",
        ),
        (
            ["flash", "x.bin"],
            f"rems has no verb 'flash'; it has {KNOWN}. Did you "
            "mean: rems board flash? Type: rems --help",
        ),
        (
            ["router", "stop"],
            "rems router has no verb 'stop'; it has use, forget, status, serve. Did "
            "you mean: rems stop? Type: rems router --help",
        ),
        (
            ["agent", "list"],
            "rems agent has no verb 'list'; it has start, bring. Did you mean: rems "
            "list? Type: rems agent --help",
        ),
        (
            ["agent", "robot", "woodbot"],
            "rems agent has no verb 'robot'; it has start, bring. Did you mean: rems "
            "agent start robot? Type: rems agent --help",
        ),
        (
            ["topic", "list"],
            f"rems has no verb 'topic'; it has {KNOWN}. Did you "
            "mean: rems list? Type: rems --help",
        ),
        (
            ["router"],
            "the following arguments are required: VERB. Type: rems router --help",
        ),
        (
            ["serve"],
            f"rems has no verb 'serve'; it has {KNOWN}. Did you mean: rems router "
            "serve? Type: rems --help",
        ),
    ],
    ids=[
        "verb",
        "file",
        "option",
        "place",
        "set",
        "other-noun",
        "top",
        "agent-list",
        "agent-robot",
        "ros",
        "noun",
        "inner",
    ],
)
def test_an_unknown_word(
    capsys: pytest.CaptureFixture[str], args: list[str], sentence: str
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(args)
    assert stop.value.code == 2
    assert uncoded(capsys.readouterr().err.rstrip("\n")) == f"rems: {sentence}"
