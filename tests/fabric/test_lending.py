"""A loan that is refused, one that is not answered, and a robot that can't be lent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import pytest

from rems_net.errors import FabricError
from rems_net.fabric.client import Client
from rems_net.fabric.lending import lend
from rems_net.router.mail import Question
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, until

ROBOT = "robot/woodbot-7"


@pytest.fixture
def client() -> Iterator[Client]:
    """An open fabric of a clock that is only present, and who asks there."""
    with Router() as router, Session(Link(router.endpoint)) as session:
        session.present(session.key("clock", "@alive"))
        yield Client(session)


@contextmanager
def robot(
    client: Client, answer: Callable[[Session, Question], None]
) -> Iterator[None]:
    """A robot in a session of its own; what it does with a question."""
    with Session(client.session.link) as session:
        session.present(session.key(ROBOT, "@alive"))
        at = session.key(ROBOT, "@lend")
        session.answer_at_once(at, partial(answer, session), apart=True)
        until(lambda: client.is_there(ROBOT))
        yield


def refused(client: Client) -> str:
    with pytest.raises(FabricError) as caught:
        lend(client, ROBOT, "team3", {})
    return str(caught.value)


def test_a_robot_that_goes_before_it_answers(client: Client) -> None:
    """It is switched off, or its link breaks, while it is asked."""

    def go(session: Session, question: Question) -> None:
        session.close()

    with robot(client, go):
        assert "robot/woodbot-7 has gone without an answer" in refused(client)


def test_a_refusal_is_the_robot_s_own(client: Client) -> None:
    def refuse(_: Session, question: Question) -> None:
        with question:
            question.refuse("it is too busy; ask again")

    with robot(client, refuse):
        assert refused(client) == f"{ROBOT}: it is too busy; ask again"


def test_a_robot_of_a_run_is_not_asked(client: Client) -> None:
    with Session(client.session.link) as session:
        session.present(session.key(ROBOT, "@alive"))
        until(lambda: client.is_there(ROBOT))
        assert f"{ROBOT} can't be lent: it is part of a run" in refused(client)


def test_a_robot_that_is_not_there(client: Client) -> None:
    assert f"there is no {ROBOT}" in refused(client)
