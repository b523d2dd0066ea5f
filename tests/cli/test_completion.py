"""`rems completion SHELL`: real shells complete what its script says."""

import os
import re
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from rems_net.cli.completion import Words, commands
from rems_net.cli.shells import SHELLS, bash, fish, powershell, zsh
from rems_net.cli.verbs import COMMANDS, NOUNS
from tests.commands import ROOT, finished, inside

GOLDEN = ROOT / "tests" / "golden" / "completion.ps1"
#: s. A completion that takes longer is felt while typing.
FELT = 0.1
#: what is typed -> some of what Tab offers
OFFERED = {
    "rems ro": ["router"],
    "rems router s": ["status", "serve"],
    "rems router use 10.0.0.1 --f": ["--fabric"],
    "rems run --pa": ["--pace"],
    "rems completion z": ["zsh"],
    "rems run la": ["lab.toml"],
    "rems plot --out pic": ["picture.png"],
}
SCRIPTS = commands()


def script(folder: Path, shell: str) -> Path:
    for name in ("lab.toml", "picture.png"):
        (folder / name).touch()
    done = inside("completion", shell)
    assert (done.returncode, done.stderr) == (0, "")
    path = folder / "script"
    path.write_text(done.stdout, encoding="utf-8")
    return path


def found(shell: str) -> str:
    path = shutil.which(shell)
    if path is None:
        pytest.skip(f"{shell} is not on PATH.")
    return path


def asked(folder: Path, *words: str) -> str:
    done = finished(words, folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("typed", OFFERED)
def test_bash(tmp_path: Path, typed: str) -> None:
    """Bash itself adds files, so here it is asked for the words alone."""
    shell, made = found("bash"), script(tmp_path, "bash")
    code = (
        'source "$1"; COMP_WORDS=($2); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _rems; '
        'echo "${COMPREPLY[@]}"; complete -p rems'
    )
    said, how = asked(tmp_path, shell, "-c", code, "-", str(made), typed).splitlines()
    files = not OFFERED[typed][0].startswith("-") and "." in OFFERED[typed][0]
    assert said.split() == ([] if files else OFFERED[typed])
    assert "-o default" in how  # of no words bash makes files


def test_bash_is_quick(tmp_path: Path) -> None:
    shell, made = found("bash"), script(tmp_path, "bash")
    code = (
        'source "$1"; COMP_WORDS=(rems router use --f); COMP_CWORD=3; '
        "time for i in {1..20}; do _rems; done"
    )
    done = subprocess.run(
        [shell, "-c", f"TIMEFORMAT=%R; {code}", "-", made],
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(done.stderr) / 20 < FELT


@pytest.mark.parametrize("typed", OFFERED)
def test_fish(tmp_path: Path, typed: str) -> None:
    shell, made = found("fish"), script(tmp_path, "fish")
    code = f"source {made}; complete -C '{typed}'"
    said = asked(tmp_path, shell, "--no-config", "-c", code)
    offered = {line.split("\t")[0] for line in said.splitlines()}
    assert {*OFFERED[typed]} <= offered


def test_zsh(tmp_path: Path) -> None:
    """A zsh in a terminal, in which Tab is pressed."""
    shell, made = found("zsh"), script(tmp_path, "zsh")
    ours, theirs = os.openpty()
    process = subprocess.Popen(
        [shell, "-f", "-i"],
        cwd=tmp_path,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**os.environ, "TERM": "dumb", "ZDOTDIR": str(tmp_path), "PS1": "% "},
        start_new_session=True,
    )
    os.close(theirs)
    try:
        # Quotes in the marks: the terminal shows what is typed, too.
        _typed(ours, f"autoload -Uz compinit; compinit -u -D; source {made}")
        _typed(ours, "; echo rea''dy\n")
        _until(ours, "ready\r\n")
        for typed, (word, *others) in OFFERED.items():
            if others:
                continue  # zsh lists several, and leaves the line as it is
            # Ctrl+A and Ctrl+E go to the beginning and the end of the line.
            _typed(ours, f"{typed}\t\x01print -r -- \"<\x05>\"; echo do''ne\n")
            text = _until(ours, "done\r\n")
            line = typed.rpartition(" ")[0]
            assert re.search(f"<{re.escape(line)} {word} ?>\r\n", text), text
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def _typed(terminal: int, keys: str) -> None:
    os.write(terminal, keys.encode())


def _until(terminal: int, wanted: str) -> str:
    """Read what a terminal shows, until this is in it."""
    text, end = "", time.monotonic() + 30
    while wanted not in text:
        assert select.select([terminal], [], [], max(end - time.monotonic(), 0))[0], (
            text
        )
        text += os.read(terminal, 4096).decode(errors="replace")
    return text


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_is_in_every_script(shell: str) -> None:
    text = SHELLS[shell](SCRIPTS)
    for command in [*COMMANDS, *NOUNS]:
        assert f"{command}'" in text or f'{command}"' in text, command
        for option in SCRIPTS[command].options:
            assert option.removeprefix("--") in text


def test_powershell() -> None:
    """The text for two commands, since no PowerShell may be here."""
    few = {
        "": Words({"--help": "show help"}, choices={"run": "", "router": ""}),
        "router": Words({"--help": "show help"}, choices={"use": "take a router"}),
        "router use": Words({"--user": "it's you"}, values={"--user": []}),
        "run": Words({"--pace": "how fast"}, values={"--pace": []}),
    }
    assert powershell(few) == GOLDEN.read_text(encoding="utf-8")
    for other in (bash, zsh, fish):
        assert "router use" in other(few)


def test_a_shell_that_is_unknown() -> None:
    done = inside("completion", "csh")
    assert done.returncode == 2
    assert "'bash', 'zsh', 'fish', 'powershell'" in done.stderr
