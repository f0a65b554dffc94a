"""What OpenUSD says of a file that it cannot read, in one line."""

from __future__ import annotations

import re


def reason(fault: Exception) -> str:
    """The last line of a `Tf.ErrorException`, without the place in OpenUSD's source; what it quotes of a damaged file may be no
    text."""
    try:
        last = (str(fault).splitlines() or ["no reason is known"])[-1].strip()
        return re.sub(r"^.*Error in '.*?' at line \d+ in file \S+ : '(.*)'$", r"\1", last)
    except UnicodeDecodeError:
        return "it holds bytes that are no text"
