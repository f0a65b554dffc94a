"""Options of what two logs may differ by, beside every command that compares some."""

from typing import Annotated

import typer

DEGREES = 0.5
"""See `vistel.log.compare.Limits`, which has the same numbers; to import it takes a second."""
MM = 5.0
"""As above."""
APART_S = 0.25
"""As above."""
MostDegrees = Annotated[
    float,
    typer.Option("--most-degrees", min=0.0, help="Degrees a joint may turn otherwise, in all but a twentieth of the postures."),
]
MostMm = Annotated[float, typer.Option("--most-mm", min=0.0, help="Millimetres a joint may be elsewhere, in the same.")]
MostApart = Annotated[
    float, typer.Option("--most-apart", min=0.0, help="How long a contact or a grasp may be in only one of the logs, seconds.")
]
