"""`rems sweep EXPERIMENT`: an experiment, run many times, into one table."""

import argparse
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from rems_net.cli.options import pairs, warn
from rems_net.errors import ExperimentError, RemsError, shown
from rems_net.sweeps.factors import listed
from rems_net.sweeps.store import CSV
from rems_net.sweeps.sweep import MOST, sweep
from rems_net.sweeps.swept import Swept

EXAMPLES = """\
examples:
  rems sweep lab.toml --set robot/sim.track=90..130mm/9 --seeds 20
  rems sweep lab.toml --set robot/sim.track="90 mm, 110 mm"
  rems sweep my_robot.py --set robot/cart.lag=0.1..0.5s/5
  rems sweep lab.toml --set robot/sim.track=90..130mm --samples 100
  rems sweep lab.toml --replace robot/sim=kinematic,mujoco
  rems sweep lab.toml --seeds 20 --measure "max(sim.state.x)"
  rems sweep lab.toml --list points.csv           a row for each point
  rems sweep lab.toml --seeds 1000 --on dask=tcp://10.0.0.5:8786

Interrupted, it goes on where it was: type the same command again.
"""
#: failed runs that are printed
SHOWN = 10
#: exit status of a sweep with a run that failed
FAILED = 1


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "experiment", metavar="EXPERIMENT", type=Path, help="a file, .toml or .py"
    )
    for option, metavar, text in (
        ("--set", "AGENT.SETTING=VALUES", "values of a setting: 90..130mm/9, or a,b,c"),
        ("--replace", "AGENT=CLASSES", "drivers, or classes of the same kind"),
        ("--measure", "EXPRESSION", "a column of results (all states at the end)"),
    ):
        parser.add_argument(
            option, metavar=metavar, action="append", default=[], help=text
        )
    for option, metavar, kind, default, text in (
        ("--seeds", "N", str, "1", "seeds of each point, or 3,5,7"),
        ("--samples", "N", int, 0, "points of a Latin hypercube, not of a grid"),
        ("--list", "FILE.csv", Path, None, "points: columns robot/sim.track [mm], ..."),
        ("--out", "DIR", Path, None, "folder (runs/<name>_sweep)"),
        ("--workers", "N", int, None, "processes (one for each core)"),
        ("--on", "CLUSTER", str, "", "dask=ADDRESS or ray=ADDRESS"),
        ("--most", "N", int, MOST, f"refuse more runs than these ({MOST:,})"),
    ):
        parser.add_argument(
            option, metavar=metavar, type=kind, default=default, help=text
        )
    parser.add_argument(
        "--parquet", action="store_true", help="also write the table as Parquet"
    )


def run(args: argparse.Namespace) -> int:
    """Make all runs, show the progress, and print where the table is."""
    settings = dict(pairs(args.set, "--set robot/sim.track=90..130mm/9"))
    settings |= dict(pairs(args.replace, "--replace robot/sim=kinematic,mujoco"))
    try:
        with _cluster(args.on) as executor:
            result = sweep(
                args.experiment,
                settings,
                seeds=_seeds(args.seeds),
                samples=args.samples,
                points=listed(args.list) if args.list else (),
                measure=args.measure,
                out=args.out,
                workers=args.workers,
                executor=executor,
                most=args.most,
                put=warn,
            )
    except (RemsError, KeyboardInterrupt) as error:
        for note in getattr(error, "__notes__", ()):
            warn(note)
        raise
    return _report(result, args)


def _report(result: Swept, args: argparse.Namespace) -> int:
    failed = result.failed
    for number, sentence in [*failed.items()][:SHOWN]:
        warn(f"run {number} failed: {sentence}")
    if len(failed) > SHOWN:
        warn(f"and {len(failed) - SHOWN} more runs failed; the table has them.")
    files = [result.folder / CSV, *([result.parquet()] if args.parquet else [])]
    print(f"{len(result)} runs, in {' and '.join(map(shown, files))}")
    return FAILED if failed else 0


def _seeds(text: str) -> int | list[int]:
    try:
        numbers = [int(one) for one in text.split(",")]
    except ValueError:
        raise ExperimentError(
            f"--seeds {text!r}: expected how many, such as 20, or a list, such as "
            "3,5,7. (R0910)"
        ) from None
    return numbers if "," in text else numbers[0]


def _cluster(text: str) -> AbstractContextManager[Executor | None]:
    """Return the executor of a cluster, or None without one. Raises ExperimentError."""
    kind, _, address = text.partition("=")
    if not text:
        return nullcontext()
    if kind == "dask" and address:
        from rems_net.sweeps.on_dask import dask_executor

        return dask_executor(address)
    if kind == "ray" and address:
        from rems_net.sweeps.on_ray import RayExecutor

        return RayExecutor(address)
    raise ExperimentError(
        f"--on {text!r}: expected dask=ADDRESS or ray=ADDRESS, such as "
        "--on dask=tcp://10.0.0.5:8786. (R1027)"
    )
