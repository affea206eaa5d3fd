"""Numbers in sentences."""


def grouped(n: int) -> str:
    """Return an integer with its digits in groups of three, for pages and figures."""
    return f"{n:,}".replace(",", "\u2009")


def counted(n: int, noun: str) -> str:
    """Return a number with its noun, such as ``1 rank`` or ``2 ranks``.

    Parameters
    ----------
    n : int
    noun : str
        In the singular, with a regular plural.
    """
    return f"{n} {noun}{'s' * (n != 1)}"
