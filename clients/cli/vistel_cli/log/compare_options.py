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
    float, typer.Option("--most-degrees", min=0.0, help="Degrees by which a joint may differ, in 19 of 20 postures.")
]
MostMm = Annotated[
    float, typer.Option("--most-mm", min=0.0, help="Millimetres by which a joint's place may differ, in 19 of 20 postures.")
]
MostApart = Annotated[
    float, typer.Option("--most-apart", min=0.0, help="Seconds for which a contact or a grasp may be in only one of the logs.")
]
