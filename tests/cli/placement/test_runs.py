"""`machine = "b"` and `rems agent bring --as b`: two laptops, the same bytes."""

from pathlib import Path

from rems_net.router.message import machine as name_of_this
from tests.agents.runs import digest
from tests.cli.conftest import KEYS, LAB, together
from tests.cli.placement.conftest import (
    BRIEF,
    ON_B,
    Pair,
    ended,
    one_line,
    wait_for,
)
from tests.interrupts import interrupt


def test_the_same_bytes_and_no_file_on_the_other_laptop(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    status, out, error = anna.rems("run", "lab.toml", "--alone", "--out", "alone")
    assert (status, error) == (0, "")
    assert "waiting" not in out
    run = anna.start("run", "lab.toml", "--out", "both")
    brought = ended(ben.bring("--as", "b"))
    router = anna.environment["REMS_ROUTER"]
    assert brought[:2] == (
        0,
        f"lab, a run of anna on {name_of_this()} (fabric 'rems' at {router}), asks "
        "machine b to start:\n"
        "  input/keys  CsvInput\n  robot/model  Woodbot done by Kinematic\n"
        "with these files, which it sends, and which are deleted at the end:\n"
        f"  data/keys.csv, {len(KEYS)} bytes\n"
        "Anybody at this router can send this under any name.\n"
        "Start it? [y/N] The run has ended.\n",
    )
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert (
        "[clock] waiting for machine b: input/keys, robot/model (on it: rems agent "
        f"bring --as b) [clock] machine b is {name_of_this()}"
    ) in one_line(out)
    folders = (anna.folder / "alone", anna.folder / "both")
    assert digest(folders[0]) == digest(folders[1])
    assert (folders[0] / "model.csv").stat().st_size > 100
    assert not list(ben.folder.iterdir())  # nothing is left there


def test_each_has_joined_and_comes_first_or_last(pair: Pair) -> None:
    """After `rems router use`, runs are on one's own fabric: the other finds it."""
    anna, ben = pair
    anna.write(lab_toml=BRIEF, data__keys_csv=KEYS)
    for laptop in pair:
        router = laptop.environment.pop("REMS_ROUTER")
        assert laptop.rems("router", "use", router)[0] == 0
    waits = ben.bring("--as", "b")
    assert waits.stderr is not None
    assert waits.stderr.readline() == (
        f"rems: no run at {router} waits for machine b yet; waiting, until one does "
        "(Ctrl+C ends it)\n"
    )
    status, _, error = anna.rems("run", "lab.toml")
    assert (status, error) == (0, "")
    status, out, error = ended(waits)
    assert (status, error) == (0, "")
    assert "(fabric 'anna-" in out


def test_a_machine_that_never_comes(pair: Pair) -> None:
    anna, _ = pair
    lab = BRIEF.replace('dt = "0.1 s"', 'dt = "0.1 s"\nwait = "2 s"')
    anna.write(lab_toml=lab, data__keys_csv=KEYS)
    status, _, error = anna.rems("run", "lab.toml")
    assert status == 1
    assert error == (
        "rems: input/keys: machine b did not bring it within 2 s; type there: rems "
        "agent bring --as b"
        " (R0521)\n"
    )


def test_a_router_that_others_cannot_reach_is_told(pair: Pair) -> None:
    """Two terminals of one laptop: it works, and says what it would not."""
    anna, ben = pair
    for laptop in pair:
        del laptop.environment["REMS_ROUTER"]
    ben.environment["XDG_RUNTIME_DIR"] = anna.environment["XDG_RUNTIME_DIR"]
    anna.write(lab_toml=BRIEF, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    said = wait_for(run, "rems agent bring")
    assert ended(ben.bring("--as", "b"))[0] == 0
    assert ended(run)[0] == 0
    assert (
        "[clock] warning: this run brings a router of its own, which only this laptop "
        "can reach; for others, first: rems router use ADDRESS"
    ) in one_line(said)


#: the output alone is on machine b; the run is native on both
APART = (
    together(LAB)
    .replace('name = "lab"', 'name = "lab"\nnative = true')
    .replace('host = "one"\nname = "log"', 'machine = "b"\nname = "log"')
)


def test_an_output_writes_where_it_is(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=APART, keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    assert ended(ben.bring("--as", "b"))[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert out.splitlines()[-1].split() == [
        "files",
        str(Path("runs/lab/run.mcap")),
    ]
    assert "computes on" not in out  # what is told of platforms that differ
    assert (ben.folder / "runs" / "lab-b" / "model.csv").is_file()
    assert not (anna.folder / "runs" / "lab" / "model.csv").exists()


def test_stay_serves_one_run_after_the_other(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=BRIEF, data__keys_csv=KEYS)
    stays = ben.bring("--as", "b", "--stay", typed="y\ny\n")
    for out in ("first", "second"):
        assert anna.rems("run", "lab.toml", "--out", out)[0] == 0
    assert digest(anna.folder / "first") == digest(anna.folder / "second")
    interrupt(stays)
    status, out, error = ended(stays)
    assert status == 130
    assert "Traceback" not in error
    assert out.count("asks machine b to start:") == 2


def test_two_runs_that_want_one_machine(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=BRIEF, data__keys_csv=KEYS)
    for team in ("team1", "team2"):
        run = anna.start("run", "lab.toml", "--fabric", team, "--out", team)
        wait_for(run, "rems agent bring")
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error.endswith(
        "2 runs wait for a machine b, on the fabrics team1, team2; choose one: "
        "--fabric NAME (R0443)\n"
    )
    assert ended(ben.bring("--as", "b", "--fabric", "team2"))[0] == 0
