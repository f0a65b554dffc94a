"""Text of others on one line."""


def one_line(text: str) -> str:
    """A text without letters that steer a terminal or the direction of writing; white space is one blank."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
