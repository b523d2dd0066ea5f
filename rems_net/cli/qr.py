"""QR codes in a terminal, and on paper."""

import io

from rich.console import Console


def show_code(console: Console, text: str) -> None:
    """Draw `text` on a terminal that is large enough.

    It is black on white in every terminal theme, with the quiet zone of four modules
    that ISO/IEC 18004 requires; one character shows two modules.
    """
    drawn = draw(text)
    wide = len(drawn.partition("\n")[0])
    fits = wide <= console.width and not console.options.ascii_only
    if console.is_terminal and fits:
        console.print(drawn, style="bright_white on black", no_wrap=True)


def draw(text: str) -> str:
    """Return the QR code of a line in half blocks, a full one for two light modules."""
    import segno

    lines = io.StringIO()
    segno.make(text, micro=False).terminal(lines, border=4, compact=True)
    return lines.getvalue().rstrip("\n")


def drawing(text: str) -> str:
    """Return the QR code of a line as SVG, to be put into a page of HTML."""
    import segno

    return str(segno.make(text, micro=False).svg_inline(scale=4, border=4))
