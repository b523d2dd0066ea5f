"""The shape of a key expression that a shared router lets through.

Zenoh compares key expressions by trying out what each `**` and `$*` may stand for, so
that several of them in one expression cost exponential time, on the thread that all
clients share; and it recurses at each chunk, so that a very long key ends the router.
The figures are in `docs/architecture.md`.
"""

from __future__ import annotations

#: chunks of a key expression. Ours have at most 9: a field of a field of a port.
CHUNKS = 12
#: bytes of a chunk. A name has at most 63 characters.
CHUNK = 64
#: bytes of a key expression that has these at most
LONGEST = CHUNKS * (CHUNK + 1) - 1

RULE = (
    f"at most {CHUNKS} chunks of {CHUNK} bytes, `**` only at the end, "
    "one `*` inside a chunk"
)


def fault(key: str) -> str | None:
    """Return what is wrong with the shape of `key`, or None.

    key: a Zenoh key expression, where `$*` stands for letters inside a chunk.
    """
    chunks = key.split("/")
    if len(chunks) > CHUNKS:
        return f"has {len(chunks)} chunks, more than {CHUNKS}"
    for chunk in chunks:
        if not chunk:
            return "has an empty chunk"
        if len(chunk) > CHUNK or len(chunk.encode()) > CHUNK:
            return f"has a chunk of more than {CHUNK} bytes"
    if "*" not in key and "$" not in key:
        return None
    for chunk in chunks[:-1]:
        if chunk == "**":
            return "has `**` elsewhere than at its end"
    for chunk in chunks:
        if chunk not in ("*", "**") and _is_odd(chunk):
            return "has a chunk with more than one `$*`, or with a `*` or `$` alone"
    return None


def _is_odd(chunk: str) -> bool:
    rest = chunk.replace("$*", "", 1)
    return "*" in rest or "$" in rest
