"""The page at a class's router: with whose rights its browsers act."""

import re
from pathlib import Path

from tests.agents.runs import free_port
from tests.commands import Run, Start

NAMES = "name,team,password\nTess,teachers,red birds fly\nAnna,team1,blue birds fly\n"


def test_a_browser_never_acts_for_the_router_itself(
    start: Start, rems: Run, folder: Path
) -> None:
    (folder / "names.csv").write_text(NAMES, encoding="utf-8")
    (folder / "names.csv").chmod(0o600)
    at = f"tcp/127.0.0.1:{free_port()}"
    words = ("--class", "names.csv", "--listen", at, "--dashboard")
    serve = start("router", "serve", *words)
    assert serve.stdout is not None
    said = ""
    while not (link := re.search(r"http://127\S+", said)):
        line = serve.stdout.readline()
        assert line, said
        said += line
    assert "#" in link.group()
    done = rems("dashboard", "--no-qr")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: Here the router of a class runs, and its own programs may do more than "
        "any teacher, so a browser gets no page by them. Type in place of it: rems "
        "router serve --class names.csv --dashboard (R0609)\n"
    )
