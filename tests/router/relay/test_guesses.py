"""Passwords can't be tried quickly, and the teacher sees that somebody does."""

import time

from rems_net.router.relay.handshake import EXPIRED, INVALID
from rems_net.router.relay.limits import GUESSES, Guesses
from tests.agents.runs import until
from tests.router.relay.conftest import PASSWORDS, Shared, many_addresses


def guess(router: Shared, password: str, host: str = "127.0.0.1") -> int:
    with router.raw(host=host) as client:
        return client.join("anna", password)


@many_addresses
def test_wrong_passwords_are_three_a_second(closed: Shared) -> None:
    begun = time.monotonic()
    answers = [guess(closed, f"wrong {i}", "127.0.0.3") for i in range(40)]
    lasted = time.monotonic() - begun
    assert set(answers) == {INVALID, EXPIRED}
    assert GUESSES <= answers.count(INVALID) <= GUESSES * (1 + lasted)
    # and the neighbour, who knows it, is let in
    assert guess(closed, PASSWORDS["anna"], "127.0.0.4") == -1
    until(lambda: "127.0.0.3 gave a wrong password" in closed.screen)
    until(lambda: "127.0.0.3 was refused" in closed.screen)
    assert "last as 'anna'" in closed.screen
    assert "wrong 1" not in closed.screen


def test_who_guessed_may_try_again_a_moment_later() -> None:
    now = 0.0
    guesses = Guesses(lambda: now)
    for _ in range(GUESSES):
        assert guesses.may("10.0.0.1")
        guesses.add("10.0.0.1")
    assert not guesses.may("10.0.0.1")
    assert guesses.may("10.0.0.2")
    now = 0.35
    assert guesses.may("10.0.0.1")
