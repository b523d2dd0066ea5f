"""The shape of a key expression that a shared router lets through.

Zenoh compares two key expressions by trying what each `**` and each `$*` may stand for.
It compares each new expression with all that the router knows. `docs/architecture.md`
explains the costs, and the effects of malformed expressions.
"""

#: chunks of a key expression. Our keys have at most 9: a field of a field of a port.
CHUNKS = 12
#: bytes of a chunk. A name has at most 63 characters.
CHUNK = 64
#: bytes of a key expression: this many chunks, and the `/` between them
LONGEST = CHUNKS * (CHUNK + 1) - 1
#: bytes of a chunk with `$*` before its end: comparing two such chunks takes the fourth
#: power of their length, 4 us at 16 bytes and 1 ms at 64
SHORT = 16

RULE = f"at most {CHUNKS} chunks, one `*` in each, and `**` only at the end"


def fault(key: str) -> str | None:
    """Return what is wrong with the shape of `key`, or None.

    key: a Zenoh key expression, where `$*` stands for letters inside a chunk. A key
    that is invalid in Zenoh is wrong here, too.
    """
    chunks = key.split("/")
    if len(chunks) > CHUNKS:
        return f"has {len(chunks)} chunks, more than {CHUNKS}"
    for chunk in chunks:
        if not chunk:
            return "has an empty chunk"
        if len(chunk) > CHUNK or len(chunk.encode()) > CHUNK:
            return f"has a chunk of more than {CHUNK} bytes"
    if not _MARKS & set(key):
        return None
    if "**" in chunks[:-1]:
        return "has `**` elsewhere than at its end"
    for chunk in chunks:
        if chunk in ("*", "**"):
            continue
        if _MARKS & set(chunk.replace("$*", "", 1) or "*"):
            return "has more than one `*` in a chunk, or one of `$#?`"
        if not chunk.endswith("$*") and "$*" in chunk and len(chunk.encode()) > SHORT:
            return f"has `*` inside a chunk of more than {SHORT} bytes"
    return None


#: special characters of key expressions
_MARKS = frozenset("*$#?")
