"""Page: A4 pages of markers to print, as SVG."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from rems_net.bodies.marker import Marker
from rems_net.errors import SchemaError
from rems_net.eyes.drawn import cells

#: mm. A4, its margin, the ruler's length, and the height of a line of text.
WIDTH, HEIGHT, MARGIN, RULER, LINE = 210.0, 297.0, 12.0, 100.0, 5.0
#: mm. Space for the ruler at the top of a page.
TOP = 24.0


def pages(markers: Sequence[Marker]) -> Iterator[str]:
    """Yield pages with these markers, all of one size. Raises SchemaError."""
    paper = 1e3 * markers[0].paper
    across = int((WIDTH - 2 * MARGIN + LINE) / (paper + LINE))
    down = int((HEIGHT - 2 * MARGIN - TOP) / (paper + 2 * LINE))
    if not across or not down:
        raise SchemaError(
            f"a marker of {1e3 * markers[0].size:.0f} mm needs {paper:.0f} mm of paper "
            f"with its white rim, and an A4 page has {WIDTH - 2 * MARGIN:.0f} mm: "
            "choose a smaller size. (R1106)"
        )
    for first in range(0, len(markers), across * down):
        drawn = []
        for place, marker in enumerate(markers[first : first + across * down]):
            row, column = divmod(place, across)
            x = MARGIN + column * (paper + LINE)
            y = MARGIN + TOP + row * (paper + 2 * LINE)
            drawn.append(_marker(marker, x, y))
        yield _page("".join([_ruler(), *drawn]))


def _page(content: str) -> str:
    size = (
        f'width="{WIDTH:g}mm" height="{HEIGHT:g}mm" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n'
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="white"/>\n'
        f'<g font-family="sans-serif" font-size="3.2">\n{content}</g>\n</svg>\n'
    )


def _ruler() -> str:
    """Return a line of 100 mm with its marks, and what it is for."""
    y = MARGIN + LINE
    marks = [
        f"M{MARGIN + mm:g} {y:g}v{2 if mm % 10 else 4}"
        for mm in range(0, int(RULER) + 1, 5)
    ]
    text = (
        "This line is 100 mm long. If yours is not, print again at 100 % (actual "
        "size), or write the size that you measure."
    )
    path = f"M{MARGIN:g} {y:g}h{RULER:g}{''.join(marks)}"
    return (
        f'<path d="{path}" stroke="black" stroke-width="0.2" fill="none"/>\n'
        f'<text x="{MARGIN:g}" y="{y + 9:g}">{text}</text>\n'
    )


def _marker(marker: Marker, x: float, y: float) -> str:
    """Return a marker with a frame to cut along, its name, and a sign at its top."""
    paper, cell = 1e3 * marker.paper, 1e3 * marker.size / marker.cells
    black = []
    for row, bits in enumerate(cells(marker).tolist()):
        column = 0
        for bit, some in groupby(bits):
            run = len([*some])
            if not bit:  # one rectangle for neighbours: no seams between them
                at = f"M{x + column * cell:.4f} {y + row * cell:.4f}"
                black.append(f"{at}h{run * cell:.4f}v{cell:.4f}h{-run * cell:.4f}z")
            column += run
    middle, shape = x + paper / 2, "".join(black)
    name = f"{marker.family} {marker.id}, {1e3 * marker.size:g} mm"
    return (
        f'<path d="{shape}" fill="black"/>\n'
        f'<rect x="{x:.4f}" y="{y:.4f}" width="{paper:.4f}" height="{paper:.4f}" '
        'fill="none" stroke="#bbb" stroke-width="0.1"/>\n'
        f'<path d="M{middle - 1.5:.3f} {y - 0.4:.3f}h3l-1.5 -2.4z" fill="#888"/>\n'
        f'<text x="{x:.3f}" y="{y + paper + 3.6:.3f}">{name}</text>\n'
    )
