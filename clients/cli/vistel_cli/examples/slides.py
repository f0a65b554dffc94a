"""Slides to try panels with, written by hand as a PDF of text.

A page is 13.33 by 7.5 inches, as presentation programs have it, in Helvetica, which every reader of PDFs has.
"""

from collections.abc import Sequence

SIZE = 960, 540
"""Of a page [points]."""
Line = tuple[float, float, float, str]
"""x and y of a line's beginning, from the lower left corner, its size [points] and its text in ASCII."""

SLIDES: tuple[tuple[Line, ...], ...] = (
    (
        (60, 440, 44, "A room for people who are apart"),
        (60, 380, 24, "Slides stand on a panel; everybody sees the same page."),
        (60, 300, 18, "18 points: take it, move it, make it larger."),
        (60, 260, 14, "14 points: pages are drawn once, where they are shown from."),
        (60, 220, 12, "12 points: a receiver gets a picture, checks it, and keeps it by its digest."),
        (60, 180, 10, "10 points: the quick brown fox jumps over the lazy dog, 0123456789."),
        (60, 140, 8, "8 points: the quick brown fox jumps over the lazy dog, 0123456789."),
    ),
    ((60, 440, 44, "Page two"), (60, 360, 24, "vistel show --next --as aiko")),
    ((60, 440, 44, "Page three"), (60, 360, 24, "vistel show --turn-to 3 --as aiko")),
)


def pdf(slides: Sequence[Sequence[Line]], size: tuple[float, float] = SIZE) -> bytes:
    """The bytes of a PDF with a page for each slide (ISO 32000-1, 7.5)."""
    kids = " ".join(f"{4 + 2 * n} 0 R" for n in range(len(slides)))
    parts = [
        "<< /Type /Catalog /Pages 2 0 R >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(slides)} /MediaBox [0 0 {size[0]} {size[1]}] >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    for n, lines in enumerate(slides):
        parts.append(f"<< /Type /Page /Parent 2 0 R /Contents {5 + 2 * n} 0 R /Resources << /Font << /F 3 0 R >> >> >>")
        bar = f"0.10 0.30 0.55 rg 0 {size[1] - 40} {size[0]} 40 re f 0.1 g\n"
        text = bar + "\n".join(f"BT /F {points} Tf {x} {y} Td ({said}) Tj ET" for x, y, points, said in lines)
        parts.append(f"<< /Length {len(text)} >>\nstream\n{text}\nendstream")
    out = "%PDF-1.4\n"
    places: list[int] = []
    for number, part in enumerate(parts, 1):
        places.append(len(out))
        out += f"{number} 0 obj\n{part}\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    end = f"trailer\n<< /Size {len(parts) + 1} /Root 1 0 R >>\nstartxref\n{len(out)}\n%%EOF\n"
    return (out + f"xref\n0 {len(parts) + 1}\n0000000000 65535 f \n{table}{end}").encode("ascii")
