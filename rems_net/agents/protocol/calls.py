"""Calls: a verb that is called over the fabric, and its answer."""

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.agents.verbs import perform
from rems_net.errors import WireError
from rems_net.router.mail import Question
from rems_net.router.message import pack


def answer_call(
    question: Question, key: str, verbs: Mapping[str, Callable[..., Any]]
) -> None:
    """Call the verb at `key`, and answer; an error goes to the caller."""
    try:
        payload = question.payload
    except WireError as error:
        question.answer(key, pack({"error": str(error)}))
        return
    question.answer(key, perform(verbs, key.rpartition("/")[2], payload))
