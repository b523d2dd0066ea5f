"""Attacks that tests of other rooms perform already: each row names its tests."""

import os
import subprocess
import sys

from tests.commands import ROOT
from tests.reliability.attacks import Bench, Outcome, attack

RELAY = "tests/router/relay"
CLASS = "tests/router/test_class.py"
HOSTILE = "tests/agents/test_hostile.py"
BRING = "tests/cli/placement"

#: attack, before, now, the tests that perform it
ROWS = (
    (
        "`rems stop` while a robot's host is frozen, and its liveliness token gone",
        "names the other robots only, exit status 0",
        "names it and its machine, exit status 1",
        (
            "tests/client/test_stop_runs.py::test_a_frozen_robot_that_is_out_of_sight_is_named",
        ),
    ),
    (
        "`rems stop` while the router of `rems router serve` is down",
        "one error, exit status 2; the robots drive on after its restart",
        "said again until the router is back; the robots stand, exit status 0",
        ("tests/cli/test_stop.py::test_the_router_of_rems_serve_is_down",),
    ),
    (
        "a member copies another's badge, and puts a second value for the same tick",
        "the recording changes without a word",
        "each reader warns: tick, key, the badge's owner",
        (f"{HOSTILE}::test_a_copied_badge_is_no_secret",),
    ),
    (
        "a command with a stamp 10^9 ticks ahead of the clock",
        "counts as fresh for ever",
        "dropped, with a warning",
        (f"{HOSTILE}::test_a_stamp_of_the_future_is_obeyed_by_nobody",),
    ),
    (
        "`@rems/who` asked about another user of the class",
        "answers anybody: role and team of every user",
        "refused by the router; about oneself it answers",
        (f"{CLASS}::test_a_user_learns_of_no_other_user",),
    ),
    (
        "lease theft: a team takes the lease of another team's robot",
        "not tried",
        "refused by the router",
        (f"{CLASS}::test_what_a_team_asks_of_the_class",),
    ),
    (
        "an experiment file with 100,000 brackets",
        "a traceback (RecursionError)",
        "one sentence, exit status 2",
        (
            "tests/cli/test_bad_input.py::test_a_file_of_many_brackets",
            "tests/router/test_users_file.py::test_a_broken_file",
        ),
    ),
    (
        "a text field that a spreadsheet takes for a formula (`=HYPERLINK(...)`)",
        "is in the recording as it came",
        "marked as a text; read back as it was",
        ("tests/outputs/test_csv.py::test_no_text_is_a_formula_of_a_spreadsheet",),
    ),
    (
        "a key with six `**` subscribed to, and a put of sixty chunks",
        "the ticks of all teams stop for 33 s",
        "the sender is disconnected; others wait less than 1 s",
        (f"{RELAY}/test_expressions.py::test_two_messages_stop_nobody",),
    ),
    (
        "a guest's key with twelve `$*` in a chunk, and a put of fifty letters",
        "the same",
        "the sender is disconnected; others wait less than 1 s",
        (f"{RELAY}/test_expressions.py::test_nor_do_a_guests",),
    ),
    (
        "one declaration of a key that is none (`x#`, `x$`)",
        "Zenoh's router panics, and serves nobody again",
        "the sender is disconnected",
        (
            f"{RELAY}/test_expressions.py::test_one_message_that_is_no_key_ends_no_router",
        ),
    ),
    (
        "2,100 and 10,000 connections that fall silent, from one address and from ten",
        "newcomers and `rems stop` are kept out",
        "a STOP is through in 1 s",
        (f"{RELAY}/test_crowds.py::test_thousands_keep_nobody_out",),
    ),
    (
        "connections without an end while a robot has lost its Wi-Fi",
        "the robot can't come back",
        "it is back in 5 s",
        (f"{RELAY}/test_crowds.py::test_a_robot_is_back_while_connections_rain",),
    ),
    (
        "sessions without an end, with one password",
        "2,000 sessions fill the router",
        "64 a user; the others come in",
        (f"{RELAY}/test_crowds.py::test_sessions_of_one_user_are_bounded",),
    ),
    (
        "the Zenoh id of a robot, of the clock or of a teacher, taken while its link "
        "is down",
        "its owner is locked out as long as the thief stays",
        "the id is its user's; the thief is refused",
        (
            f"{RELAY}/test_ids.py::test_nobody_else_gets_the_id_of_a_user",
            f"{RELAY}/test_ids.py::test_a_guess_does_not_end_the_connection_of_a_robot",
        ),
    ),
    (
        "passwords tried one after the other",
        "as fast as the network; nobody sees it",
        "3 a second from one address, and a line on the teacher's screen",
        (f"{RELAY}/test_guesses.py::test_wrong_passwords_are_three_a_second",),
    ),
    (
        "a member's session in router or peer mode",
        "sees other teams' badges",
        "refused: only clients are let in",
        (f"{RELAY}/test_gate.py::test_only_clients_are_let_in",),
    ),
    (
        "selectors of 10 kB; 5,000 messages with bytes changed",
        "not tried",
        "read in their length; what can't be read ends its sender only",
        ("tests/router/gate/test_frames.py",),
    ),
    (
        "a run that asks `rems agent bring` for a file of this laptop, by an absolute "
        "path",
        "the first line of the file, a password, is sent back",
        "refused unopened; one fixed sentence goes back",
        (f"{BRING}/test_question.py::test_a_password_stays_where_it_is",),
    ),
    (
        "the same by `..`, `~`, links, names of Windows, or names inside a model",
        "opened",
        "refused unopened",
        (
            f"{BRING}/test_attacks.py::test_no_file_of_elsewhere",
            f"{BRING}/test_attacks.py::test_no_model_names_a_file_of_elsewhere",
        ),
    ),
    (
        "a run that names a serial port, or another host, of this laptop",
        "opened",
        "asked for at the keyboard",
        (f"{BRING}/test_attacks.py::test_a_port_or_an_address_is_asked_for",),
    ),
    (
        "`/dev/zero`, a pipe or a huge file instead of a table, a model or a list",
        "read until memory ends",
        "one sentence",
        ("tests/inputs/test_reading.py::test_no_device_pipe_or_huge_file_is_read",),
    ),
    (
        "a run of a stranger on an open router",
        "started without a question",
        "shown and asked for; without a terminal refused",
        (
            f"{BRING}/test_question.py::test_no_answer_but_yes_starts_anything",
            f"{BRING}/test_question.py::test_an_open_router_vouches_for_nobody",
        ),
    ),
    (
        "a class of the owner's folder that is no agent, named by a run",
        "imported: its code runs",
        "its source is looked at first, and refused",
        (f"{BRING}/test_attacks.py::test_a_class_is_looked_at_before_it_is_imported",),
    ),
)


def _add(name: str, before: str, now: str, tests: tuple[str, ...]) -> None:
    @attack(name, before, quick=False)
    def perform(bench: Bench) -> Outcome:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-m", "slow or not slow", *tests],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode == 0:
            return Outcome(now, True)
        return Outcome(done.stdout.strip().splitlines()[-1], False)

    perform.__name__ = tests[0].rpartition("::")[2].rpartition("/")[2]


for row in ROWS:
    _add(*row)
