"""A run that is none starts nothing, and who asks a run nonsense is refused."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from rems_net.agents.experiment.placement.bring import REFUSED, serve_run
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.placement import File, Offer, read_caller
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.protocol.fuzz import OFFER, PLAN
from tests.agents.runs import Router
from tests.cli.conftest import KEYS
from tests.cli.placement.conftest import ON_B, Pair, ended, wait_for


def forge(offer: Offer, definition: str, driver: str) -> bytes:
    agents = {"robot": [PLAN | {"definition": definition, "driver": driver}]}
    code = offer.code if definition.startswith("lab.py:") else {}
    return offer._replace(agents=agents, code=code).to_wire()


MADE = "rems_net.drivers.kinematic.kinematic:Kinematic"
FORGED = {
    "another module": (
        forge(OFFER, "subprocess:Popen", MADE),
        "'subprocess:Popen', which is no definition of rems_net",
    ),
    "a driver as a definition": (
        forge(OFFER, MADE, MADE),
        "which is no definition of rems_net",
    ),
    "code without a digest": (
        forge(OFFER, "other.py:Cart", MADE),
        "expected the digest of other.py, too",
    ),
    "code of elsewhere": (
        forge(OFFER, "../lab.py:Cart", MADE),
        "expected a name below the folder",
    ),
    "code behind a link": (
        OFFER._replace(
            agents={"robot": [PLAN | {"definition": "link.py:Cart"}]},
            code={"link.py": "f" * 64},
        ).to_wire(),
        "link.py is not here",
    ),
    "a module of Python": (forge(OFFER, "os:system", MADE), "no definition of rems"),
    "a class of ours that is no part": (
        forge(
            OFFER, "rems_net.robots.woodbot:Woodbot", "rems_net.cli.agent.bring:Asked"
        ),
        "which is no driver of rems_net",
    ),
    "a device of Windows": (
        OFFER._replace(files={"data/nul.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "an alternate stream": (
        OFFER._replace(files={"keys.csv:x.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a file that is a folder, too": (
        OFFER._replace(
            files={"a.csv": File(1, "0" * 64), "a.csv/b.csv": File(1, "0" * 64)}
        ).to_wire(),
        "names that differ in letters",
    ),
    "a very long name": (
        OFFER._replace(files={"a" * 300 + ".csv": File(1, "0" * 64)}).to_wire(),
        "at most 255 printable characters",
    ),
    "a zero byte in a name": (
        OFFER._replace(files={"a\0.csv": File(1, "0" * 64)}).to_wire(),
        "printable characters",
    ),
    "depth": (b"\x91" * 200_000 + b"\xc0", "no message"),
    "a plan of 17 MB": (bytes(17_000_000), "does not send what to bring"),
    "code that is not the same": (OFFER.to_wire(), "lab.py differs here and on laptop"),
    "a class inside a module": (
        forge(OFFER, "lab.py:a b", MADE),
        "expected module:Class or file.py:Class",
    ),
    "an absolute file": (
        OFFER._replace(files={"/etc/keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a file above": (
        OFFER._replace(files={"a/../../keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a file with a drive": (
        OFFER._replace(files={"C:keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a hidden file": (
        OFFER._replace(files={".ssh/keys.txt": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "code as data": (
        OFFER._replace(files={"site.py": File(1, "0" * 64)}).to_wire(),
        "expected one that ends with",
    ),
    "too large a file": (
        OFFER._replace(files={"keys.csv": File(2**40, "0" * 64)}).to_wire(),
        "expected a whole number from 0 to 67108864",
    ),
    "too many bytes": (
        OFFER._replace(
            files={f"{i}.csv": File(2**26, "0" * 64) for i in range(2)}
        ).to_wire(),
        "67108864 bytes at most",
    ),
    "too many files": (
        OFFER._replace(
            files={f"{i}.csv": File(1, "0" * 64) for i in range(201)}
        ).to_wire(),
        "a map of at most 200 words",
    ),
    "two files that are one elsewhere": (
        OFFER._replace(
            files={"a.csv": File(1, "0" * 64), "A.csv": File(1, "0" * 64)}
        ).to_wire(),
        "names that differ in letters",
    ),
    "too many processes": (
        OFFER._replace(
            agents={"robot": [PLAN | {"name": f"r{i}"} for i in range(101)]}
        ).to_wire(),
        "expected at most 100 processes",
    ),
    "a folder as the experiment's name": (
        OFFER._replace(name="../x").to_wire(),
        "the experiment's name is '../x'",
    ),
    "noise": (b"\xc1", "no message"),
    "five": (pack(5), "expected a map of name, user, laptop"),
}


@pytest.fixture(scope="module")
def link() -> Iterator[Link]:
    with Router() as router:
        yield Link(router.endpoint)


def serve(link: Link, folder: Path) -> None:
    """Be machine b of a run, whatever that wants."""
    with Session(link) as session:
        serve_run(session, "b", folder, Show(), lambda asked: None)


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_offer_starts_nothing(name: str, link: Link, tmp_path: Path) -> None:
    payload, sentence = FORGED[name]
    (tmp_path / "here").mkdir()
    (tmp_path / "lab.py").write_text("raise SystemExit('it was run')")
    (tmp_path / "here" / "lab.py").write_text("raise SystemExit('it was run')")
    with suppress(OSError):  # on Windows only some users can make links
        (tmp_path / "here" / "link.py").symlink_to(tmp_path / "lab.py")
    troubles: list[bytes] = []

    def answer(question: Question) -> None:
        troubles.append(question.payload)
        question.answer("rems/machine/b/@start", payload)

    with Session(link) as session:
        session.answer_at_once("rems/machine/b/@start", answer)
        with pytest.raises((ExperimentError, FabricError, WireError)) as caught:
            serve(link, tmp_path / "here")
    assert sentence in str(caught.value)
    # A busy network is asked again; else nothing of this laptop goes back.
    for payload in troubles:
        assert payload == troubles[0] or read_caller(payload).trouble == REFUSED


DATA = b"x" * (2**20 + 5)
PIECES = {
    "nothing": (None, FabricError, "does not send its files"),
    "too much": (lambda part: DATA, WireError, "in a piece of 1048581 bytes"),
    "too little": (lambda part: b"", WireError, "in a piece of 0 bytes"),
    "something else": (
        lambda part: bytes(2**20 if part == 0 else 5),
        WireError,
        "another SHA-256 came",
    ),
}


@pytest.mark.parametrize("name", PIECES)
def test_a_file_that_does_not_come_whole(
    name: str, link: Link, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, error, sentence = PIECES[name]
    plan = PLAN | {"definition": "rems_net.robots.woodbot:Woodbot"}
    files = {"keys.csv": File(len(DATA), "0" * 64)}
    offer = OFFER._replace(agents={"robot": [plan]}, code={}, files=files).to_wire()

    def piece(question: Question) -> None:
        if send is not None:
            part = int(question.parameters["part"])
            question.answer(f"rems/machine/b/@file/{'0' * 64}", send(part))

    (tmp_path / "here").mkdir()
    with Session(link) as session:
        session.answer_at_once(
            "rems/machine/b/@start",
            lambda question: question.answer("rems/machine/b/@start", offer),
        )
        session.answer_at_once("rems/machine/b/@file/*", piece)
        with pytest.raises(error) as caught:
            serve(link, tmp_path / "here")
    assert sentence in str(caught.value)
    assert not list((tmp_path / "here").iterdir())


def test_who_asks_a_run_nonsense_is_refused_and_bounded(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    wait_for(run, "rems agent bring")
    key = "rems/machine/b"
    with Session(Link(anna.environment["REMS_ROUTER"])) as session:
        for payload in (b"\xc1", pack(5), pack(["x"]), pack(["x", "y\x1b" * 9000])):
            with pytest.raises(FabricError):
                session.ask(f"{key}/@start", payload)
        for i in range(100):
            session.ask(f"{key}/@start", pack(["x", f"trouble {i}\x1b[2J"]))
        for file in ("passwd", "0" * 64, "*"):
            assert session.ask(f"{key}/@file/{file}?part=0") == []
        assert session.ask(f"{key}/@file/{'0' * 64}?part=-1") == []
    assert ended(ben.bring("--as", "b"))[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert 20 < out.count("trouble") <= 30
    assert "\x1b" not in out
