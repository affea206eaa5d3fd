"""What a user has typed, made fit to stand in a message."""


def printable(text: str, longest: int) -> str:
    """Return a text on one line, without what would steer a terminal.

    Parameters
    ----------
    text : str
    longest : int
        Number of characters beyond which the text is cut off.

    Returns
    -------
    str
        Control and other invisible characters are written as escapes.
    """
    shown = text if len(text) <= longest else f"{text[: longest - 3]}..."
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in shown
    )
