"""Contents of an MCAP file, as a screen of text."""

from collections.abc import Iterator

from rems_net.recordings.mcap.columns import read_blocks
from rems_net.recordings.mcap.reader import McapFile

#: keys whose fields are shown with what they range over
SHOWN = 20
#: fields of a key that are shown
FIELDS = 6


def describe(file: McapFile) -> Iterator[str]:
    """Yield lines: what was run, when, and for each key its rate and its ranges.

    Each key's chunks are read once, and one is in memory at a time.
    """
    told, many = file.told, {"process": "processes"}
    counted = [
        f"{len(some)} {kind if len(some) == 1 else many.get(kind, f'{kind}s')}"
        for kind, some in told.agents.items()
    ]
    name = told.experiment or "an experiment without a name"
    yield f"what  {'; '.join([name, *counted, f'seed {told.seed}'])}"
    steps = f", in ticks of {told.dt:g} s" if told.dt else ""
    yield f"when  until {file.end:g} s of fabric time{steps}"
    total, keys = sum(file.counts.values()), len(file.channels)
    size = file.path.stat().st_size / 1e6
    yield f"size  {size:.3g} MB, {total} values of {keys} keys"
    if not file.whole:
        yield "      It has no end: its writer was killed. It was read all the same."
    for key in [*file.channels][:SHOWN]:
        count = file.counts[key]
        rate = f", {count / file.end:.3g} a second" if file.end else ""
        yield f"{key}: {count}{rate}"
        yield from _ranges(file, key)
    if keys > SHOWN:
        yield f"and {keys - SHOWN} more keys"
    for topic, why in file.passed.items():
        yield f"passed over: {topic}; {why}"


def _ranges(file: McapFile, key: str) -> Iterator[str]:
    """Yield least and most of each column of numbers."""
    ends: dict[str, tuple[float, float]] = {}
    units = {path: one.unit for path, one in file.schemas[key].rows()}
    for _, columns in read_blocks(file, key):
        for name, values in columns.items():
            if values.dtype.kind == "f" and len(values):
                low, high = ends.get(name, (values[0], values[0]))
                ends[name] = min(low, values.min()), max(high, values.max())
    for name, (low, high) in [*ends.items()][:FIELDS]:
        unit = units.get(name.partition("[")[0], "")
        yield f"    {name}  {low:.4g} to {high:.4g} {unit}".rstrip()
    if len(ends) > FIELDS:
        yield f"    and {len(ends) - FIELDS} more"
