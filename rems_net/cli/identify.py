"""`rems identify DIR --robot ROBOT`: a robot's parameters from how it drove."""

import argparse
from pathlib import Path
from typing import Any

from rems_net.cli.options import add_like, add_run, console, recording_of, settings_of

EXAMPLES = """\
examples:
  rems identify --robot real                  from the newest run
  rems identify runs/monday --robot real --check runs/tuesday
  rems identify runs/monday --robot real --out real.identified.toml
  rems identify runs/demo --robot mujoco --fit track,max_wheel_speed
  rems identify runs/demo --robot mujoco --suggest next.csv
  rems identify runs/demo --robot mujoco --driver mujoco --fit mass,wheel_torque
  rems identify lab.csv --like woodbot-class --definition woodbot \\
      --set track="100 mm" --set max_wheel_speed="6.8 rad/s"
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_like(parser)
    sets: dict[str, Any] = {"action": "append", "default": [], "dest": "sets"}
    text, path = {"default": ""}, {"type": Path}
    for option, metavar, more, said in (
        ("--robot", "ROBOT", text, "which robot"),
        (
            "--definition",
            "DEFINITION",
            text,
            "its definition, if the recording does not name one: woodbot, my.py:Cart",
        ),
        (
            "--set",
            "NAME=VALUE",
            sets,
            "a parameter as it was in the recording, if that does not have it",
        ),
        ("--fit", "NAME,NAME", text, "parameters to identify (all with an effect)"),
        (
            "--check",
            "DIR",
            path,
            "another run of this robot, which is only predicted (else each third of "
            "the run is predicted from the rest)",
        ),
        (
            "--driver",
            "DRIVER",
            text,
            "predict with this simulator, such as mujoco: it is slow, and knows mass "
            "and friction; with --fit",
        ),
        ("--out", "FILE", path, "write the parameters there: real.identified.toml"),
        (
            "--suggest",
            "FILE",
            path,
            "name the short drive that would show most, and write it to a CSV file "
            "that an input plays",
        ),
    ):
        parser.add_argument(option, metavar=metavar, help=said, **more)


def run(args: argparse.Namespace) -> int:
    """Identify, and print what was found."""
    from rems_net.identification.recorded import identify
    from rems_net.recordings.recording import read

    for file in filter(None, (args.out, args.suggest)):  # before what takes minutes
        file.parent.mkdir(parents=True, exist_ok=True)
    out = console(args)
    with out.status("identify") as status:  # shown on a terminal only
        found = identify(
            recording_of(args),
            args.robot,
            definition=args.definition,
            parameters=settings_of(args.sets, 'track="100 mm"'),
            fit=[name for name in args.fit.replace(" ", "").split(",") if name],
            check=read(args.check, like=args.like) if args.check else None,
            suggest=args.suggest is not None,
            driver=args.driver,
            progress=status.update,
        )
    if found.suggestions:
        table = found.suggestions[0].table()
        args.suggest.write_text(table, encoding="utf-8", newline="\n")
    for line in found.lines():
        out.print(line, soft_wrap=True)
    if args.out:
        found.write(args.out)
        out.print(f"They are in {args.out}. In place of that line, this will do:")
        out.print(f'  parameters = "{args.out.name}"', soft_wrap=True)
    return 0
