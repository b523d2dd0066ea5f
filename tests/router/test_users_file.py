"""The file of a router's users: what is wrong in it, and what the router says."""

import os
import re
import sys
from pathlib import Path

import pytest

from rems_net.errors import FabricError, uncoded
from rems_net.router.gate.users import load
from tests.agents.runs import free_port
from tests.commands import begun, environment
from tests.interrupts import interrupt

unix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no mode here")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            '[members]\nanna = "geheim" x\n',
            "FILE, line 2, column 17: this is no TOML; expected a line such as anna = "
            '"seven green herons".',
        ),
        (
            f"[members]\nanna = {'[' * 100_000}",
            "FILE, line 2, column 108: this is no TOML; expected a line such as anna = "
            '"seven green herons".',
        ),
        (
            '[member]\nanna = "secret heron"\n',
            "FILE: 'member' is no role; expected the tables [members] and [guests], "
            'and in each a line for each user, such as anna = "seven green herons". '
            "Did you mean 'members'?",
        ),
        (
            'anna = "secret heron"\n',
            "FILE: 'anna' is no role; expected the tables [members] and [guests], and "
            'in each a line for each user, such as anna = "seven green herons".',
        ),
        (
            "[members]\nanna = 12345678\n",
            "FILE: the password of 'anna' can't be used; expected 8 to 128 letters in "
            "quotes, with no blank at the ends.",
        ),
        (
            '[members]\nanna = "geheim"\n',
            "FILE: the password of 'anna' can't be used; expected 8 to 128 letters in "
            "quotes, with no blank at the ends.",
        ),
        (
            '[members]\nanna = "secret\\nheron"\n',
            "FILE: the password of 'anna' can't be used; expected 8 to 128 letters in "
            "quotes, with no blank at the ends.",
        ),
        (
            '[members]\n"a:b" = "secret heron"\n',
            "FILE: the name of a user is 'a:b'; a name has 1 to 63 letters, digits, "
            "'_', '-' or '.', begins with a letter or a digit, and ends with no '.'.",
        ),
        (
            '[members]\nanna = "secret heron"\n[guests]\nanna = "secret heron"\n',
            "FILE: 'anna' is in two tables; expected one. Remove one of its lines.",
        ),
        (
            '[guests]\nanna = "secret heron"\n',
            "FILE has 0 members among 1 users; expected at least 1, who can run "
            "experiments, and at most 1000 users. Write below [members] a line such as "
            'anna = "seven green herons".',
        ),
    ],
)
def test_a_broken_file(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "users.toml"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(FabricError) as caught:
        load(path)
    assert uncoded(caught.value) == sentence.replace("FILE", str(path))
    assert not re.search("geheim|secret|12345678", str(caught.value))


def router_says(*args: str) -> tuple[int, str, str]:
    """What `python -m rems_net.router` says, ended once it has begun."""
    words = [sys.executable, "-W", "error", "-m", "rems_net.router", *args]
    process = begun(words, env=environment(PYTHONUNBUFFERED="1"))
    assert process.stdout is not None
    assert process.stderr is not None
    with process, process.stdout, process.stderr:
        out = process.stdout.readline()
        if out:
            interrupt(process)
        out += process.stdout.read()
        err = process.stderr.read()
    return process.returncode, out, err


def test_a_router_says_who_is_let_in(file: Path) -> None:
    port = free_port()
    listen = f"tcp/0.0.0.0:{port}"
    status, out, err = router_says("--listen", listen, "--users", str(file))
    assert (status, err) == (0, "")
    assert out.splitlines()[1:] == [
        f"{file}: 1 member, 1 guest; nobody else is let in."
    ]


def test_an_open_router_says_so() -> None:
    port = free_port()
    status, out, err = router_says("--listen", f"tcp/0.0.0.0:{port}")
    assert (status, err) == (0, "")
    assert out.splitlines()[1:] == [
        "All who reach it can stop and end runs; limit it by "
        f"--listen tcp/127.0.0.1:{port} or --users FILE"
    ]
    status, out, err = router_says("--listen", f"tcp/127.0.0.1:{port}")
    assert (status, err, out.count("\n")) == (0, "", 1)


@unix
def test_a_file_that_others_can_read(file: Path) -> None:
    file.chmod(0o644)
    assert router_says("--users", str(file)) == (
        2,
        "",
        f"{file} holds passwords, and other users of this machine can use it (mode "
        f"644). Type: chmod 600 {file}"
        " (R0608)\n",
    )


def test_a_file_that_is_not_there(file: Path) -> None:
    wrong = file.with_name("user.toml")
    assert router_says("--users", str(wrong)) == (
        2,
        "",
        f"There is no file {wrong}. Did you mean 'users.toml'? (R0608)\n",
    )
