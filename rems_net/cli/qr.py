"""QR: a line of text for who has a camera and would rather not type."""

from __future__ import annotations

import io

from rich.console import Console


def show(console: Console, text: str) -> None:
    """Draw `text` on a terminal, where it fits and can be shown.

    Black on white whatever the colours of the terminal are, with the quiet zone of four
    modules that readers of ISO/IEC 18004 may expect; two modules make a letter.
    """
    drawn = draw(text)
    wide = len(drawn.partition("\n")[0])
    fits = wide <= console.width and not console.options.ascii_only
    if console.is_terminal and fits:
        console.print(drawn, style="bright_white on black", no_wrap=True)


def draw(text: str) -> str:
    """Its code in half blocks, a full one for two light modules."""
    import segno

    lines = io.StringIO()
    segno.make(text, micro=False).terminal(lines, border=4, compact=True)
    return lines.getvalue().rstrip("\n")
