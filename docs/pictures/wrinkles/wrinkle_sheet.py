"""Puts wrinkle-sheet.png together: what the dissertation's figures 45 to 51 show, row by row, from the pictures
that wrinkles.py has drawn.

    python -m docs.pictures.wrinkles.wrinkle_sheet [--out FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

HERE = Path(__file__).parent
LINE, GAP = 18, 4
"""Of the sheets that wrinkles.py draws: height of their names, and between their cells [pixels]."""
TALL, WIDE, MARGIN = 190, 196, 8
CAPTION = 218
CELL = {"shapes": (380, 190), "texture": (340, 340), "traced": (280, 280), "sleeve": (300, 300), "face": (270, 270)}

Part = tuple[str, int, int] | str
ROWS: tuple[tuple[str, str, tuple[Part, ...]], ...] = (
    ("Figure 45", "Characteristic shapes: curves whose points have intensity and thickness; they branch and vanish",
     (("shapes/curves", 0, 1), ("shapes/curves", 0, 0), ("shapes/curves", 2, 3), ("shapes/curves", 2, 0))),
    ("Figures 46, 48", "The primitive: density f falls off from the curve. Its ends are half discs, or taper; on the right one,"
     " twice as large", ("profile", ("texture", 0, 0), ("texture", 1, 0), ("texture/end", 1, 0))),
    ("Figure 47", "A displacement map is the sum of all wrinkles; cloth displaced by it and lit; two more pieces",
     (("texture", 2, 0), ("texture", 2, 1), ("traced", 3, 0), ("traced", 3, 1))),
    ("Figure 49a", "From a picture of cloth to weighted curves to new wrinkles; a print before and after",
     (("traced", 0, 1), ("traced", 2, 1), ("texture", 0, 1), ("texture", 1, 1))),
    ("Figure 49b", "A sleeve straight, bent without wrinkles, and with them: it is pulled up, and its outline changes",
     (("sleeve", 0, 0), ("sleeve", 2, 0), ("sleeve", 2, 1), ("sleeve", 3, 1))),
    ("Figure 50", "Skin: furrows are light alone, the texture stays where it is",
     (("face", 0, 0), ("face", 1, 0), ("face", 2, 0), ("face", 3, 0))),
    ("Figure 51", "Brows raised and a smile, seen in profile",
     (("face", 0, 1), ("face", 1, 1), ("face", 3, 1), ("face", 1, 2))),
)  # fmt: skip


def cell(name: str, column: int, row: int) -> Image.Image:
    """A cell of a sheet; after a slash which part of it."""
    sheet, _, part = name.partition("/")
    width, height = CELL[sheet]
    left, top = column * (width + GAP), row * (height + LINE) + LINE
    picture = Image.open(HERE / f"wrinkle-{sheet}.png").convert("RGB").crop((left, top, left + width, top + height))
    if part == "curves":
        picture = picture.crop((0, 0, width // 2, height))
    elif part == "end":
        picture = picture.crop((width // 2, height // 3, width, height // 3 + width // 2))
    return picture.resize((TALL, TALL), Image.Resampling.LANCZOS)


def profile() -> Image.Image:
    """f of the distance in radii."""
    out = Image.new("RGB", (2 * TALL, 2 * TALL), (250, 250, 250))
    ink, side = ImageDraw.Draw(out), 2 * TALL - 60
    ink.line([(30, 30), (30, 30 + side), (30 + side, 30 + side)], (120, 124, 130), 3)
    x = np.linspace(0.0, 1.0, 60)
    y = (1.0 - x * x) ** 2
    ink.line([(30 + side * float(a), 30 + side * (1.0 - float(b))) for a, b in zip(x, y, strict=True)], (40, 70, 140), 6)
    font = ImageFont.load_default(26)
    ink.text((30 + side * 0.42, 60), "f(|P - Q| / r)", (40, 44, 50), font)
    return out.resize((TALL, TALL), Image.Resampling.LANCZOS)


def wrapped(text: str, letters: int) -> str:
    """Lines of so many letters at most."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= letters:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=HERE)
    arguments = parser.parse_args()
    high = TALL + MARGIN
    out = Image.new("RGB", (CAPTION + 4 * WIDE, MARGIN + len(ROWS) * high), "white")
    ink = ImageDraw.Draw(out)
    for k, (number, caption, parts) in enumerate(ROWS):
        top = MARGIN + k * high
        ink.text((MARGIN, top), number, (20, 24, 30), ImageFont.load_default(18))
        ink.multiline_text((MARGIN, top + 28), wrapped(caption, 30), (60, 64, 70), ImageFont.load_default(13), spacing=4)
        for n, part in enumerate(parts):
            out.paste(profile() if isinstance(part, str) else cell(*part), (CAPTION + n * WIDE, top))
    out.save(arguments.out / "wrinkle-sheet.png", optimize=True)


if __name__ == "__main__":
    main()
