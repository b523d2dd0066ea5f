"""Every mistake is one sentence on stderr, exit status 2, and nothing has started."""

import sys
from pathlib import Path

import pytest

from rems_net.agents.experiment.file import EXPERIMENT, ROBOT
from rems_net.agents.registry import BUILT_IN
from rems_net.cli import main
from tests.cli.complaint import INPUT, MODEL, complaint

ROBOT_KEYS = f"it may have {', '.join(ROBOT)}."


pytestmark = pytest.mark.usefixtures("nothing_starts")

TOML = [
    (
        "an unknown key of the experiment",
        ('name = "lab"', 'nmae = "lab"'),
        "lab.toml, [experiment]: there is no key 'nmae'; [experiment] may have "
        f"{', '.join(EXPERIMENT)}. Did you mean 'name'?",
    ),
    (
        "an unknown key of a robot",
        ("parameters", "paramters"),
        f"{MODEL}there is no key 'paramters'; {ROBOT_KEYS} Did you mean 'parameters'?",
    ),
    (
        "an unknown key of an input",
        ("file =", "fiel ="),
        f"{INPUT}CsvInput.options has no field 'fiel'. Did you mean 'file'?",
    ),
    (
        "an unknown table",
        ("[[robot]]", "[[robbot]]"),
        "lab.toml: there is no table [robbot]; expected [experiment], [[input]], "
        "[[robot]], [[world]], [[process]], [[output]]. Did you mean 'robot'?",
    ),
    (
        "single brackets",
        ("[[robot]]", "[robot]"),
        "lab.toml: there may be several of robot: write [[robot]], with double "
        "brackets.",
    ),
    (
        "an unknown definition",
        ('"woodbot"', '"wodbot"'),
        f"{MODEL}There is no definition 'wodbot'; there is "
        f"{', '.join(BUILT_IN['definition'])}, or your own as 'my_file.py:MyClass'. "
        "Did you mean 'woodbot'?",
    ),
    (
        "an unknown driver",
        ('"kinematic"', '"kinematik"'),
        f"{MODEL}There is no driver 'kinematik'; there is "
        f"{', '.join(BUILT_IN['driver'])}, or your own as 'my_file.py:MyClass'. "
        "Did you mean 'kinematic'?",
    ),
    (
        "a definition that is no text",
        ('"woodbot"', "5"),
        f"{MODEL}definition is 5; expected text in quotes.",
    ),
    (
        "an unknown type",
        ('type = "csv"', 'type = "cvs"'),
        f"{INPUT}There is no input 'cvs'; there is csv, gamepad, hand, keyboard, "
        "replay, or your own as 'my_file.py:MyClass'. Did you mean 'csv'?",
    ),
    (
        "an unknown source",
        ('"input/keys"', '"input/kyes"'),
        f"{MODEL}robot/model.command is connected to 'input/kyes', and there is no "
        "'input/kyes'; there is input/keys, robot/model. Did you mean "
        "'input/keys'?",
    ),
    (
        "a parameter in the wrong unit",
        ('"0.1 m"', '"0.1 s"'),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        "but got '0.1 s': s (time) cannot become m (length). Type a number in m, or a "
        'text such as "1.5 m".',
    ),
    (
        "text where a number belongs",
        ('"0.1 m"', '"wide"'),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        "but got 'wide'. Type a number, such as 1.5 or \"1.5 m\".",
    ),
    (
        "a number meant in another unit",
        ('"0.1 m"', "100"),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        'but got 100. Did you mean "100 mm"?',
    ),
    (
        "text meant in another unit",
        ('"0.1 m"', '"100"'),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        "but got '100'. Did you mean \"100 mm\"?",
    ),
    (
        "a number out of range, and no word of Python",
        ('"0.1 m"', "1.5"),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        "but got 1.5.",
    ),
    (
        "NaN",
        ('"0.1 m"', "nan"),
        f"{MODEL}Woodbot.parameters: 'track' expects a number in m from 0.001 to 1, "
        "but got nan.",
    ),
    (
        "an unknown parameter",
        ("track", "trak"),
        f"{MODEL}Woodbot.parameters has no field 'trak'. Did you mean 'track'?",
    ),
    (
        "a dt that is no time",
        ('"0.1 s"', '"0.1 m"'),
        "lab.toml, [experiment]: dt: the value expects a number in s, but got '0.1 m': "
        "m (length) cannot become s (time). Type a number in s, or a text such as "
        '"1.5 s".',
    ),
    (
        "a duration of 0",
        ('"1 s"', "0"),
        "lab.toml, [experiment]: duration is 0; expected 1e-9 s to 1e9 s.",
    ),
    (
        "a duration that is no multiple of dt",
        ('duration = "1 s"', 'duration = "1.25 s"'),
        "lab.toml: duration is 1.25 s, which is no multiple of dt = 0.1 s; expected "
        "1.2 s (12 steps) or 1.3 s (13).",
    ),
    (
        "a duration below one step",
        ('"1 s"', '"40 ms"'),
        "lab.toml: duration is 0.04 s, less than one step of dt = 0.1 s.",
    ),
    (
        "a pace that is none",
        ("dt =", 'pace = "fats"\ndt ='),
        "lab.toml, [experiment]: pace is 'fats'; expected \"fast\" or a factor of real "
        "time, 0.001 to 10000, such as 1.0. Did you mean 'fast'?",
    ),
    (
        "two agents of one name",
        (
            "[[output]]",
            '[[robot]]\nname = "model"\ndefinition = "woodbot"\n'
            'driver = "kinematic"\n[[output]]',
        ),
        f"{MODEL}there are two agents named robot/model; give one another name.",
    ),
    (
        "no name",
        ('name = "model"\n', ""),
        "lab.toml, [[robot]] number 1: name is missing; write a line such as "
        'name = "left".',
    ),
    (
        "no TOML",
        ('name = "lab"', 'name "lab"'),
        "lab.toml, line 2, column 6: this is no TOML: Expected '=' after a key in a "
        "key/value pair.",
    ),
    (
        "a text without quotes",
        ('dt = "0.1 s"', "dt = 0.1 s  # slow"),
        "lab.toml, line 3, column 10: this is no TOML: Expected newline or end of "
        'document after a statement. Write dt = "0.1 s".',
    ),
    (
        "quotes of a word processor",
        ('"keys.csv"', "“keys.csv”"),
        "lab.toml, line 9, column 16: this is no TOML: Invalid value. Write "
        'options.file = "keys.csv".',
    ),
    (
        "a decimal comma",
        ('"0.1 s"', "0,1"),
        "lab.toml, line 3, column 7: this is no TOML: Expected newline or end of "
        "document after a statement. Write dt = 0.1.",
    ),
    (
        "a missing CSV file",
        ('"keys.csv"', '"kyes.csv"'),
        f"{INPUT}there is no file kyes.csv in FOLDER. Did you mean 'keys.csv'?",
    ),
]


@pytest.mark.parametrize(
    ("edit", "sentence"), [case[1:] for case in TOML], ids=[case[0] for case in TOML]
)
def test_in_the_experiment(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    edit: tuple[str, str],
    sentence: str,
) -> None:
    path = folder / "lab.toml"
    path.write_text(path.read_text().replace(*edit, 1), encoding="utf-8")
    assert complaint(capsys, "run", "lab.toml") == sentence.replace(
        "FOLDER", str(folder)
    )


def test_a_file_that_hides_the_package(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "rems_net.py").touch()
    assert main(["run", "lab.toml"]) == 2
    assert capsys.readouterr().err == (
        "rems: lab.toml: rems_net.py, in this folder, hides rems_net from its own "
        "processes. Rename it, for example to my_rems_net.py."
        " (R0431)\n"
    )


@pytest.mark.parametrize(
    ("text", "at"),
    [
        (f"a = {'[' * 100_000}", ", line 1, column 105"),
        (f"a = {'{b = ' * 100_000}", ", line 1, column 505"),
        (f"{'a.' * 1000}a = 1", ", end of document"),
    ],
    ids=["lists", "tables", "dots"],
)
@pytest.mark.parametrize("verb", ["run", "check"])
def test_a_file_of_many_brackets(
    verb: str, text: str, at: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "lab.toml").write_text(text)
    assert complaint(capsys, verb, "lab.toml") == (
        f"lab.toml{at}: this is no TOML: it has more than 100 tables or lists one "
        "inside the other."
    )


@pytest.mark.skipif(sys.platform != "linux", reason="no folder of Linux's own")
def test_a_folder_of_the_system(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As System32 is, in which a terminal of Windows may begin; not even for root."""
    said = complaint(capsys, "demo", "--out", "/sys/demo")
    assert said.startswith("cannot make the folder /sys/demo: ")
    assert said.endswith(". Go to a folder of your own: cd ~")
