"""Notes of routers: nobody else writes them, reads others' files through them, or leads
us astray by one."""

import json
import os
import re
import shutil
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.router import find, notes
from rems_net.router.notes import Note
from tests.commands import Done, command, environment, finished

#: a user who is not us, and needs no name
OTHER = 54321

unix = pytest.mark.skipif(
    not hasattr(os, "getuid"), reason="files have neither owner nor mode here"
)
as_root = pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0 or not shutil.which("setpriv"),
    reason="only root can be another user, by setpriv",
)


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary folder that every user can write, and no XDG_RUNTIME_DIR."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    folder.chmod(0o1777)
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    return folder


@pytest.fixture
def listener() -> Iterator[str]:
    """Something that takes connections: where a forged note would lead."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


def rems(*args: str, uid: int | None = None) -> Done:
    """The real command, as this user or another."""
    become = [] if uid is None else ["setpriv", f"--reuid={uid}", "--clear-groups"]
    return finished(
        [*become, *command(*args)], env=environment(PYTHONDONTWRITEBYTECODE="1")
    )


def test_a_note_leads_to_its_router() -> None:
    session, note = find.serve("rems")
    with session:
        assert notes.read(note) == Note(session.link.endpoint, session.id)
        with find.open_session("rems") as joined:
            assert joined.routers() == [session.id]
        if hasattr(os, "getuid"):
            assert note.stat().st_mode & 0o777 == 0o600
            assert note.parent.stat().st_mode & 0o777 == 0o700
        assert [p.name for p in note.parent.iterdir()] == [note.name]
    note.unlink()


def test_notes_of_a_fabric_whose_name_begins_alike_are_left_alone() -> None:
    note = notes.write("rems-lab", 1, Note("tcp/127.0.0.1:1", "nobody"))
    assert notes.find("rems") == []
    assert notes.find("rems-lab") == [note]
    with pytest.raises(FabricError, match="No fabric 'rems' is running"):
        find.open_session("rems")
    assert note.exists()


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b'{"endpoint": 1}', b"\xff\xfe"])
def test_what_is_no_note_is_removed(text: bytes) -> None:
    note = notes.folder() / "rems-1.json"
    note.write_bytes(text)
    assert notes.read(note) is None
    with pytest.raises(FabricError, match="No fabric 'rems' is running"):
        find.open_session("rems")
    assert not note.exists()


def test_a_note_replaces_what_lies_there_and_follows_no_link(tmp_path: Path) -> None:
    precious = tmp_path / "thesis.txt"
    precious.write_text("years of work")
    (notes.folder() / "rems-7447.json").symlink_to(precious)
    note = notes.write("rems", 7447, Note("tcp/127.0.0.1:7447", "ab"))
    assert precious.read_text() == "years of work"
    assert notes.read(note) == Note("tcp/127.0.0.1:7447", "ab")
    assert not note.is_symlink()


@unix
def test_a_note_that_is_a_link_or_a_pipe_is_not_believed(tmp_path: Path) -> None:
    told = tmp_path / "told.json"
    told.write_text(json.dumps({"endpoint": "tcp/127.0.0.1:1", "router": "ab"}))
    note = notes.folder() / "rems-1.json"
    note.symlink_to(told)
    sentence = (
        f"{note} is a link, so it is not believed; expected a note that a run of "
        f"yours has left. Remove {note}"
    )
    done = rems("stop")
    assert (done.returncode, done.stdout, done.stderr) == (
        2,
        "",
        f"rems: {sentence} (R0612)\n",
    )
    assert note.is_symlink()
    note.unlink()
    os.mkfifo(note)  # opening one waits for its writer, unless told not to
    with pytest.raises(FabricError, match="is no file, so it is not believed"):
        find.open_session("rems")


@unix
@pytest.mark.parametrize(
    ("how", "what"),
    [
        ("link", "is a link; expected a folder of yours alone. Remove it, or set "),
        ("file", "is no folder; expected a folder of yours alone. Remove it, or set "),
        ("mode", "is open to other users (mode 777); expected a folder of yours alone"),
    ],
)
def test_a_folder_that_is_not_ours_alone(
    shared: Path, tmp_path: Path, how: str, what: str
) -> None:
    mine = shared / f"rems_net-{os.getuid()}"
    if how == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        mine.symlink_to(tmp_path / "elsewhere")
    elif how == "file":
        mine.write_text("")
    else:
        mine.mkdir()
        mine.chmod(0o777)
    done = rems("list")
    assert done.returncode == 2
    assert done.stdout == ""
    assert f"{mine}, where the notes of running routers are, {what}" in done.stderr
    assert done.stderr.count("\n") == 1
    if how == "mode":
        assert f"type: chmod 700 {mine} (R0612)\n" in done.stderr
        mine.chmod(0o700)
        assert "No fabric 'rems' is running" in rems("list").stderr


@as_root
def test_another_user_cannot_point_stop_elsewhere(shared: Path, listener: str) -> None:
    """He makes our folder before we do, and leaves a note in it."""
    mine = shared / f"rems_net-{os.getuid()}"
    mine.mkdir()
    note = mine / "rems-7447.json"
    note.write_text(json.dumps({"endpoint": listener, "router": "ab"}))
    for path in (mine, note):
        os.chown(path, OTHER, OTHER)
    for verb in ("stop", "list"):
        done = rems(verb)
        assert done.returncode == 2
        assert done.stderr == (
            f"rems: {mine}, where the notes of running routers are, belongs to "
            f"another user (number {OTHER}); expected a folder of yours alone. Set "
            "XDG_RUNTIME_DIR to a folder of your own."
            " (R0612)\n"
        )
    assert note.exists()


@as_root
def test_a_note_of_another_user_is_not_believed(listener: str) -> None:
    note = notes.write("rems", 7447, Note(listener, "ab"))
    os.chown(note, OTHER, OTHER)
    done = rems("stop")
    assert done.returncode == 2
    assert done.stderr == (
        f"rems: {note} belongs to another user (number {OTHER}), so it is not "
        "believed; expected a note that a run of yours has left. "
        f"Remove {note}"
        " (R0612)\n"
    )
    assert note.exists()


@as_root
def test_users_of_one_machine_do_not_see_each_other(shared: Path) -> None:
    """Both without XDG_RUNTIME_DIR: each has a folder, and reads no other's."""
    for parent in [shared, *shared.parents]:
        if not parent.stat().st_mode & 0o001:
            parent.chmod(parent.stat().st_mode | 0o011)
    session, note = find.serve("rems")
    with session:
        ours = shared / f"rems_net-{os.getuid()}"
        assert note.parent == ours
        done = rems("list", uid=OTHER)
        unread = ("No module", "Permission denied", "error while loading shared")
        if any(words in done.stderr for words in unread):
            pytest.skip("another user cannot read this Python")
        assert "No fabric 'rems' is running" in done.stderr
        assert (shared / f"rems_net-{OTHER}").stat().st_uid == OTHER
        probe = f"open({str(note)!r}, 'w')"
        as_other = ["setpriv", f"--reuid={OTHER}", "--clear-groups", sys.executable]
        tried = finished([*as_other, "-c", probe])
        assert re.search("Permission", tried.stderr)
        assert notes.read(note) == Note(session.link.endpoint, session.id)
    note.unlink()
