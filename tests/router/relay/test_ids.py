"""A Zenoh id belongs to the user, or the address, that came with it first."""

import pytest

from rems_net.router.relay import ids
from rems_net.router.relay.handshake import TAKEN
from rems_net.router.relay.ids import Ids
from tests.agents.runs import until
from tests.router.relay.conftest import PASSWORDS, Shared, many_addresses

LET_IN = -1


def join(router: Shared, user: str, zid: bytes) -> int:
    with router.raw(zid) as client:
        return client.join(user, PASSWORDS[user])


@pytest.mark.parametrize("owner", PASSWORDS)
def test_nobody_else_gets_the_id_of_a_user(closed: Shared, owner: str) -> None:
    thief = next(user for user in PASSWORDS if user != owner)
    with closed.raw() as robot:
        assert robot.join(owner, PASSWORDS[owner]) == LET_IN
        zid = robot.zid
        assert join(closed, thief, zid) == TAKEN
    # the link is down, and the id is still the owner's
    assert join(closed, thief, zid) == TAKEN
    assert join(closed, owner, zid) == LET_IN
    until(lambda: f"has the id of one of {owner}" in closed.screen)


def test_a_robot_that_is_back_ends_its_old_connection(closed: Shared) -> None:
    with closed.raw() as lost, closed.raw(lost.zid) as back:
        assert lost.join("anna", PASSWORDS["anna"]) == LET_IN
        assert back.join("anna", PASSWORDS["anna"]) == LET_IN
        assert lost.closed


def test_a_guess_does_not_end_the_connection_of_a_robot(closed: Shared) -> None:
    with closed.raw() as robot:
        assert robot.join("anna", PASSWORDS["anna"]) == LET_IN
        with closed.raw(robot.zid) as guess:
            assert guess.join("anna", "wrong password") != LET_IN
        robot.send(b"\x04")  # it is alive, and the router takes its word
        robot.socket.settimeout(0.2)
        assert not robot.closed


@many_addresses
def test_an_id_goes_with_a_robot_to_another_address(router: Shared) -> None:
    """A laptop gets another address by DHCP; it has no name that would prove it."""
    with router.raw(host="127.0.0.2") as robot:
        assert robot.join() == LET_IN
        with router.raw(robot.zid, "127.0.0.3") as thief:
            assert thief.join() == TAKEN
    until(lambda: _joins(router, robot.zid, "127.0.0.3"))


@many_addresses
def test_a_robot_takes_its_id_back_from_a_later_address(router: Shared) -> None:
    with router.raw(host="127.0.0.2") as robot:
        assert robot.join() == LET_IN
    until(lambda: _joins(router, robot.zid, "127.0.0.3"))
    until(lambda: _joins(router, robot.zid, "127.0.0.4"))
    with router.raw(robot.zid, "127.0.0.4") as thief:
        assert thief.join() == LET_IN
        with router.raw(robot.zid, "127.0.0.2") as back:
            assert back.join() == LET_IN
            assert thief.closed
            with router.raw(robot.zid, "127.0.0.3") as later:
                assert later.join() == TAKEN


def _joins(router: Shared, zid: bytes, host: str) -> bool:
    """Return whether a client is let in; the end of a session takes a moment."""
    with router.raw(zid, host) as client:
        return client.join() == LET_IN


def test_the_id_of_a_user_is_never_free() -> None:
    kept = Ids(named=True)
    kept.bind(b"robot", "anna")
    kept.end(b"robot", "anna")
    assert kept.holder(b"robot", "ben") == "anna"
    assert not kept.holder(b"robot", "anna")


def test_what_is_known_of_ids_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ids, "OF_OWNER", 3)
    monkeypatch.setattr(ids, "OWNERS", 2)
    kept = Ids(named=True)
    for zid in (b"1", b"2", b"3", b"4"):
        kept.bind(zid, "anna")
        kept.end(zid, "anna")
    holders = [kept.holder(zid, "dora") for zid in (b"1", b"2", b"4")]
    assert holders == ["", "anna", "anna"]
    for owner in ("ben", "carl"):
        kept.bind(owner.encode(), owner)
    holders = [kept.holder(zid, "dora") for zid in (b"4", b"ben", b"carl")]
    assert holders == ["", "ben", "carl"]


def test_the_id_of_a_session_that_lives_is_never_forgotten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However many an owner has: on an open router a class may share one address."""
    monkeypatch.setattr(ids, "OF_OWNER", 2)
    kept = Ids(named=False)
    for zid in (b"1", b"2", b"3", b"4"):
        kept.bind(zid, "10.0.0.1")
    assert kept.holder(b"1", "10.0.0.2") == "10.0.0.1"
    kept.end(b"3", "10.0.0.1")
    kept.bind(b"5", "10.0.0.1")
    holders = [kept.holder(zid, "10.0.0.2") for zid in (b"1", b"3", b"5")]
    assert holders == ["10.0.0.1", "", "10.0.0.1"]
