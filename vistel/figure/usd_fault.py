"""What OpenUSD says of a file that it cannot read, in one line."""

from __future__ import annotations


def reason(fault: Exception) -> str:
    """The last line of a `Tf.ErrorException`; what it quotes of a damaged file may be no text."""
    try:
        return (str(fault).splitlines() or ["no reason is known"])[-1].strip()
    except UnicodeDecodeError:
        return "it holds bytes that are no text"
