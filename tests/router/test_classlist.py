"""A class list, its passwords, and the slips that they are on."""

import os
from pathlib import Path

import pytest

from rems_net.errors import FabricError, uncoded
from rems_net.router.gate.classlist import load_class, slips_of, typed
from rems_net.router.gate.users import OWNER
from tests.router.conftest import NAMES

unix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no mode here")


def test_passwords_are_made_once(names: Path) -> None:
    first = load_class(names, "rems", "192.168.1.20")
    assert first.count == "3 students in 2 teams, 1 teacher"
    assert first.teams == {"team1": ["anna.berg", "celik.oz"], "team2": ["ben.cho"]}
    assert len(set(first.passwords.values())) == 4
    assert all(len(word) == 14 for word in first.passwords.values())
    assert not any(word in repr(first) for word in first.passwords.values())
    slips = slips_of(names)
    assert slips.name == "names.slips.txt"
    text = slips.read_text(encoding="utf-8")
    use = "  rems router use 192.168.1.20"
    anna = f"{use} --user anna.berg\n  password: {first.passwords['anna.berg']}\n"
    assert anna in text
    assert names.read_text(encoding="utf-8") == NAMES  # it is left as it is
    names.write_text(NAMES + "Dora;team3\n", encoding="utf-8")
    second = load_class(names, "rems")
    assert second.passwords.items() > first.passwords.items()
    assert second.passwords["dora"] in slips.read_text(encoding="utf-8")
    assert sorted(p.name for p in names.parent.iterdir() if p.is_file()) == [
        "names.csv",
        "names.slips.txt",
    ]


def test_who_is_at_the_router_is_let_in_again_after_a_restart(names: Path) -> None:
    _, *first = load_class(names, "rems").with_owner()
    names.write_text(NAMES + "Dora;team3\n", encoding="utf-8")
    users, *second = load_class(names, "rems").with_owner()
    assert first == second
    assert users.passwords[OWNER] == second[1]
    slips_of(names).unlink()  # another password of the teacher's
    _, *third = load_class(names, "rems").with_owner()
    assert third[1] != first[1]


@unix
def test_slips_are_for_one_pair_of_eyes(names: Path) -> None:
    load_class(names, "rems")
    slips = slips_of(names)
    assert slips.stat().st_mode & 0o777 == 0o600
    slips.chmod(0o644)
    with pytest.raises(FabricError, match=f"Type: chmod 600 {slips}"):
        load_class(names, "rems")
    slips.unlink()
    # So is a list that says passwords itself.
    names.write_text("name,team,password\nAnna,teachers,seven herons\nBen,a,\n")
    with pytest.raises(FabricError, match=f"Type: chmod 600 {names}"):
        load_class(names, "rems")
    names.chmod(0o600)
    users = load_class(names, "rems")
    assert users.passwords["anna"] == "seven herons"
    assert users.names["members"] == ["anna"]
    assert users.teams == {"a": ["ben"]}


@unix
@pytest.mark.skipif(
    hasattr(os, "getuid") and os.getuid() == 0, reason="root can write everywhere"
)
def test_slips_that_cannot_be_kept(names: Path) -> None:
    names.parent.chmod(0o500)
    try:
        with pytest.raises(FabricError, match="where the passwords of the class are"):
            load_class(names, "rems")
    finally:
        names.parent.chmod(0o700)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "nome,team\nAnna,a\n",
            "FILE, line 1: its columns are nome, team; expected name, team, and "
            "password where you choose them yourself.",
        ),
        (
            "",
            "FILE has no names in it; expected the columns name and team, and below "
            "them a line for each user, such as: Anna Berg,team1",
        ),
        (
            "name,team,team\nAnna,a,b\n",
            "FILE, line 1: its columns are name, team, team; expected name, team, and "
            "password where you choose them yourself.",
        ),
        (
            "name,team\nBerg, Anna,team1\n",
            "FILE, line 2 has 3 cells, and there are 2 columns; write a name with a "
            'comma in quotes: "Berg, Anna".',
        ),
        (
            "name,team\n\x1b[31mAnna,a\n",
            "FILE, line 2: its name is '\\x1b[31mAnna'; expected one with letters from "
            "a to z, or digits, such as 'Anna Berg' and 'team1'.",
        ),
        (
            f"name,team\n{'a' * 200_000},a\n",
            "FILE, line 2: this is no table: field larger than field limit (131072).",
        ),
        (
            "name,team\nAnna,a\nanna,b\n",
            "FILE: lines 2 and 3 are both the user 'anna'; write an initial "
            "behind one of the names.",
        ),
        (
            "name,team\nTeacher,a\n",
            "FILE: line 2 and the teacher (team 'teachers') are both the user "
            "'teacher'; write an initial behind one of the names.",
        ),
        (
            "name,team\nAnna,lab\nBen,lab-2\n",
            "FILE: 'lab' is a team, and 'lab-2' is another team: 'lab' has all the "
            "fabrics whose names begin with 'lab-'. Give it another name.",
        ),
        (
            "name,team\nAnna,rems\n",
            "FILE: 'rems' is a team, and 'rems' is the class's fabric: 'rems' has all "
            "the fabrics whose names begin with 'rems-'. Give it another name.",
        ),
        (
            "name,team,password\nAnna,a,geheim\n",
            "FILE: the password of 'anna' can't be used; expected 8 to 128 letters in "
            "quotes, with no blank at the ends.",
        ),
    ],
)
def test_a_list_that_is_none(names: Path, text: str, sentence: str) -> None:
    names.write_text(text, encoding="utf-8")
    names.chmod(0o600)
    with pytest.raises(FabricError) as caught:
        load_class(names, "rems")
    assert uncoded(caught.value) == sentence.replace("FILE", str(names))
    assert not slips_of(names).exists()


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffName;Team;;\r\nAnna Berg;Team 1;;\r\n;;;\r\n",
        "sep=;\nTeam;Name\nTeam 1;Anna Berg\n",
        "name\tteam\nAnna Berg\tTeam 1\n",
        'name,team\n"Anna; Berg",Team 1',
        "name,team\nAnna\xa0Berg ,Team\xa01\n",
    ],
)
def test_what_spreadsheets_write(names: Path, text: str) -> None:
    names.write_text(text, encoding="utf-8")
    assert load_class(names, "rems").teams == {"team.1": ["anna.berg"]}


def test_what_is_typed_for_a_name() -> None:
    words = ["Anna Berg", " Çelik  Öz ", "Team 3", "x-1_a", "O'Neil, P.", "  ", "王"]
    words += [
        "Jörg Weiß",
        "Łukasz Żółw",
        "SØREN ÆRØ",
        "I\u015f\u0131l \u00dcnal",
        "İpek",
    ]
    assert [typed(word) for word in words] == [
        "anna.berg",
        "celik.oz",
        "team.3",
        "x-1_a",
        "o.neil.p",
        "",
        "",
        "jorg.weiss",
        "lukasz.zolw",
        "soren.aero",
        "isil.unal",
        "ipek",
    ]
