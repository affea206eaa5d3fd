"""Templates of pages, alike in all packages that have some."""

import jinja2


def templates_of(*packages: str) -> jinja2.Environment:
    """Return the templates of packages, those of the first before others of the name.

    All text is escaped, and a name that is missing is an error.
    """
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(p) for p in packages]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
