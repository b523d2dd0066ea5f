"""Attacks by files and texts."""

from rems_net.agents.tick import Tick
from rems_net.defdict import Schema, text
from rems_net.outputs.csv import CsvOutput
from tests.reliability.attacks import Bench, Outcome, attack


@attack(
    "an experiment file with 100,000 brackets",
    "a traceback (RecursionError)",
    quick=False,
)
def brackets(bench: Bench) -> Outcome:
    (bench.folder / "lab.toml").write_text(f"a = {'[' * 100_000}")
    users = bench.folder / "users.toml"
    users.write_text(f"[members]\nanna = {'[' * 100_000}")
    users.chmod(0o600)
    done = [
        bench.rems("run", "lab.toml"),
        bench.rems("check", "lab.toml"),
        bench.rems("router", "serve", "--listen", "127.0.0.1", "--users", "users.toml"),
    ]
    held = all(
        one.returncode == 2
        and "Traceback" not in one.stderr
        and one.stderr.count("\n") == 1
        for one in done
    )
    return Outcome("one sentence, exit status 2" if held else "a traceback", held)


@attack(
    "a text field that a spreadsheet takes for a formula (`=HYPERLINK(...)`)",
    "is in the recording as it came",
)
def formula(bench: Bench) -> Outcome:
    said = Schema("state", {"say": text()})({"say": '=HYPERLINK("http://x")'})
    log = CsvOutput("log", out=bench.folder)
    log.prepare()
    log.open()
    log.__dict__ |= {"robots": {"robot/bot/state": said}, "worlds": {}}
    log.write(Tick(1, 0.1, 0.1))
    log.close()
    held = ",\"'=" in (bench.folder / "bot.csv").read_text(encoding="utf-8")
    return Outcome(
        "marked as a text; read back as it was" if held else "unchanged", held
    )
