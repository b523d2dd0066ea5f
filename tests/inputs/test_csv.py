"""CsvInput: which row holds when, our format and the class's, and its speed."""

from pathlib import Path

import pytest

from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import Field
from rems_net.errors import ExperimentError
from rems_net.inputs.csv import CsvInput


def opened(folder: Path, text: str) -> CsvInput:
    (folder / "keys.csv").write_text(text, encoding="utf-8")
    made = CsvInput("keys", options={"file": "keys.csv"}, folder=folder)
    made.prepare()
    return made


def played(agent: CsvInput, dt: float, ticks: int) -> list[list[float]]:
    found = []
    for n in range(1, ticks + 1):
        agent.step(Tick(n, time_of(n, dt), dt))
        found.append(list(agent.value.flat().values()))
    return found


def test_a_row_holds_until_its_time(tmp_path: Path) -> None:
    agent = opened(tmp_path, "time [s],command/speed [m/s]\n0.2,1\n0.5,2\n")
    assert agent.end == 0.5
    expected = [1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0]
    assert played(agent, 0.1, 7) == [[value] for value in expected]
    speed = agent.value.schema["speed"]
    assert isinstance(speed, Field)
    assert speed.unit == "m/s"


def test_the_row_that_covers_the_middle_of_the_step(tmp_path: Path) -> None:
    """0.31 covers the middle of (0.2, 0.3] and of no later step; so does 0.29."""
    for between in ("0.26", "0.29", "0.30000000000000004", "0.31", "0.34"):
        text = f"time [s],command/speed [m/s]\n{between},1\n1.0,2\n"
        assert [row[0] for row in played(opened(tmp_path, text), 0.1, 4)] == [
            1,
            1,
            1,
            2,
        ]


def test_a_row_shorter_than_a_step_may_be_passed_over(tmp_path: Path) -> None:
    text = "time [s],command/speed [m/s]\n0.1,1\n0.11,9\n0.2,2\n"
    assert played(opened(tmp_path, text), 0.1, 2) == [[1.0], [2.0]]


def test_a_row_at_zero_that_says_nothing_may_be_there(tmp_path: Path) -> None:
    text = "time [s],command/speed [m/s]\n0.0,0\n0.2,1\n"
    assert played(opened(tmp_path, text), 0.1, 3) == [[1.0], [1.0], [0.0]]


def test_any_dt_plays_the_same_file(tmp_path: Path) -> None:
    agent = opened(tmp_path, "time [ms],command/speed [m/s]\n200,1\n500,2\n")
    assert agent.end == pytest.approx(0.5)
    assert [row[0] for row in played(agent, 0.05, 11)] == [1.0] * 4 + [2.0] * 6 + [0.0]


def test_the_files_of_the_class(tmp_path: Path) -> None:
    """Only the inputs are read; a comment may hold commas and odd characters."""
    text = (
        "timestamp,inpt.wh.l,inpt.wh.r,state.x,outpt.lidar_f, comments\n"
        "0.0,0.0,0.0,-0.0,0.0,      //Init state\n"
        "0.6,100.0,-50.0,-0.0,0.0, // straight, then µ\n"
    )
    agent = opened(tmp_path, text)
    assert list(agent.value.schema.paths) == ["wheel/left", "wheel/right"]
    assert [field.unit for field in agent.value.schema.fields] == ["percent"] * 2
    assert played(agent, 0.1, 1) == [[100.0, -50.0]]


def test_arrays_text_and_truth(tmp_path: Path) -> None:
    text = (
        "time [s],command/arm[0] [deg],command/arm[1] [deg],command/hold [bool],"
        'command/mode [text],note\n1.0,10,20,True,"fast, far",x\n'
    )
    agent = opened(tmp_path, text)
    agent.step(Tick(1, 0.1, 0.1))
    assert agent.value["arm"].tolist() == [10.0, 20.0]
    assert agent.value["hold"] is True
    assert agent.value["mode"] == "fast, far"


@pytest.mark.parametrize(
    "text",
    [
        "time [s],command/speed [m/s]\r\n1.0,2.0\r\n",
        "\ufefftime [s],command/speed [m/s]\n1.0,2.0\n\n   \n",
        '"time [s]","command/speed [m/s]"\n"1.0","2.0"',
        "note,command/speed [m/s],time [s]\nx,2.0,1.0\n",
    ],
    ids=["windows", "byte order mark", "quoted", "another order"],
)
def test_ways_to_write_it(tmp_path: Path, text: str) -> None:
    assert played(opened(tmp_path, text), 0.5, 1) == [[2.0]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("\n", "keys.csv is empty"),
        ("time [s]\n1\n", "no column is a command"),
        ("timestamp,inpt.wh.x\n1,2\n", "Did you mean 'inpt.wh.r'?"),
        ("time [s],command/a[0],command/a[2]\n1,2,3\n", "elements missing"),
        ("time [s],command/a [bool]\n1,yes\n", "expected True or False, but got 'yes'"),
        ("time [s],command/a\n1,1_000\n", "expected a number, but got '1_000'"),
        ("time [s],command/a\ninf,1\n", "column 'time [s]': expected a number in s"),
        (
            "time [s],command/a\n-1,0\n0,0\n0.0,1\n",
            "expected a time after 0, which the line before has",
        ),
        (
            "time [s],command/a\n-1,0\n0,5\n1,1\n",
            "keys.csv, line 3, column 'time [s]': a row holds until its time, so this "
            "one, at 0 s, is never played; write when it ends, or remove the line.",
        ),
        ('time [s],command/a\n1,"2\n', "line 2: this is no CSV (unexpected end"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ExperimentError) as refused:
        opened(tmp_path, text)
    assert said in str(refused.value)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "keys.csv").mkdir()
    with pytest.raises(ExperimentError, match=r"cannot read keys\.csv: .*directory"):
        CsvInput("keys", options={"file": "keys.csv"}, folder=tmp_path).prepare()


def test_a_hundred_thousand_rows(tmp_path: Path) -> None:
    """Takes half a second; a look-up that walks the file would take minutes."""
    lines = [f"{n / 10!r},{n % 7}\n" for n in range(1, 100_001)]
    agent = opened(tmp_path, "time [s],command/speed\n" + "".join(lines))
    for n in (*range(1, 20_001), 99_999, 100_000):
        agent.step(Tick(n, n / 10, 0.1))
        assert agent.value["speed"] == n % 7
