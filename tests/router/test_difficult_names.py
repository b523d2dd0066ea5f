"""Names that are difficult to type, to tell apart or to read: each person logs in."""

import re
from pathlib import Path

import pytest

from rems_net.errors import FabricError, uncoded
from rems_net.router.gate.classlist import load_class, slips_of, typed
from rems_net.router.gate.identity import Identity, identity
from rems_net.router.session import Session
from rems_net.router.settings import Link
from rems_net.router.stop_store import class_router
from tests.agents.runs import free_port

#: cells of a table as a spreadsheet writes them, and the user each one becomes
PEOPLE = {
    "İpek Şahin": "ipek.sahin",
    "I\u015f\u0131l \u00dcnal": "isil.unal",
    "ÇAĞRI YILDIZ": "cagri.yildiz",
    "Gökçe Öztürk": "gokce.ozturk",
    "Łukasz Żółw": "lukasz.zolw",
    "Świętosława Źdźbło": "swietoslawa.zdzblo",
    "王芳 Wang Fang": "wang.fang",
    "Li Wei (李伟)": "li.wei",
    "\uff37\uff41\uff4e\uff47\u3000\uff2c\uff45\uff49": "wang.lei",
    "Иван Ivan Petrov": "ivan.petrov",
    "Nguyễn Thị Đào": "nguyen.thi.dao",
    "José Peña": "jose.pena",
    "Jose\u0301 Pen\u0303alver": "jose.penalver",  # accents of their own, as on macOS
    "Søren Ærø": "soren.aero",
    "Åsa Ångström": "asa.angstrom",
    "Jörg Weiß": "jorg.weiss",
    "Þórður Guðmundsson": "thordur.gudmundsson",
    "Əli Həsənov": "eli.hesenov",
    "Ħal Għarb": "hal.gharb",
    "Kɔfi Mɛnsah": "kofi.mensah",
    "Ŋura Ŧuomas": "ngura.tuomas",
    "Cœur Zoë": "coeur.zoe",
    "Anne-Marie Dubois": "anne-marie.dubois",
    "Anne\u2011Sophie Martin": "anne-sophie.martin",  # a hyphen that does not break
    "Smith\u2013Jones, Pat": "smith-jones.pat",  # a dash
    "O'Neil Sean": "o.neil.sean",
    "O\u2019Brien Sean": "o.brien.sean",
    "Kapi\u02bbolani Ka\u02bbawa": "kapi.olani.ka.awa",
    "'t Hooft Gerard": "t.hooft.gerard",
    '"Berg, Anna"': "berg.anna",
    '"Berg; Ben"': "berg.ben",
    '"Carla ""Caro"" Diaz"': "carla.caro.diaz",
    '"Dora\r\nEngel"': "dora.engel",  # two lines in one cell
    " Eva \u00a0 Frank ": "eva.frank",
    "Fatma\u200b G\u00fcl": "fatma.gul",  # a blank that has no width
    "\u200fGita H.\u200e": "gita.h",  # marks of a direction
    "Hans M\u00fcller jr.": "hans.muller.jr",
    "R2-D2": "r2-d2",
    "Ng": "ng",
    "María Fernández de la Vega": "maria.fernandez.de.la.vega",
    f"Anna {'Long ' * 12}Name": "anna" + ".long" * 11 + ".lon",  # 63 letters
}


def _quoted(cell: str, mark: str) -> str:
    return f'"{cell}"' if mark in cell and cell[0] != '"' else cell


TEXT = "name,team\r\n" + "".join(
    f"{_quoted(name, ',')},Team {i % 4}\r\n" for i, name in enumerate(PEOPLE)
)


def test_forty_people_log_in(tmp_path: Path) -> None:
    names = tmp_path / "names.csv"
    names.write_bytes(TEXT.encode())
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with class_router(endpoint, load_class(names, "rems")):
        text = slips_of(names).read_text("utf-8")
        slips = re.findall(
            r"-\n(\S.*?) +(team\.\d)\n  .* --user (\S+)\n +password: (\S+)\n", text
        )
        assert [user for _, _, user, _ in slips] == [*PEOPLE.values()]
        for name, team, user, password in slips:
            assert typed(name) == user  # its owner finds it
            with Session(Link(endpoint, user=user, password=password)) as session:
                assert identity(session) == Identity("", team, "rems")


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_each_way_a_spreadsheet_saves_it(tmp_path: Path, code: str, mark: str) -> None:
    names = tmp_path / "names.csv"
    rows = [line.rpartition(",") for line in TEXT.split("\r\n")]
    text = "\r\n".join(f"{_quoted(a, mark)}{mark if b else ''}{c}" for a, b, c in rows)
    text = "\ufeff" + text if code.endswith("e") else text
    names.write_bytes(text.encode(code))
    users = load_class(names, "rems")
    assert [*users.passwords] == [*PEOPLE.values(), "teacher"]


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (
            "王芳,a\nBen,a\n李伟,b\n",
            "FILE: names without a letter from a to z can't be typed on every laptop. "
            "Write one beside it, such as '王芳 Wang Fang', in line 2 (王芳), "
            "4 (李伟).",
        ),
        (
            "Ömer,a\nBen,a\nOmer,b\n",
            "FILE: lines 2 and 4 are both the user 'omer'; write an initial "
            "behind one of the names.",
        ),
        (
            ",a\nBen,a\n",
            "FILE, line 2: it has a team and no name; write one, or remove the line.",
        ),
        (
            "Anna,a\nBen,\n",
            "FILE, line 3: 'Ben' has no team; write one into each line, as in the "
            "first.",
        ),
        (
            'Anna,a\n"Ben,a\nCarla,a\n',
            "FILE, line 4: this is no table: a quote is open.",
        ),
    ],
)
def test_a_row_that_cannot_be_used(tmp_path: Path, rows: str, sentence: str) -> None:
    names = tmp_path / "names.csv"
    names.write_text(f"name,team\n{rows}", encoding="utf-8")
    with pytest.raises(FabricError) as caught:
        load_class(names, "rems")
    assert uncoded(caught.value) == sentence.replace("FILE", str(names))
