"""Bodies of every shape that the program lists, made from the schema alone."""

from mpisph.case import case_schema
from mpisph.case.bodies import SHAPES


def names():
    """The names of all shapes, as case files write them."""
    return [properties(shape)["shape"]["const"] for shape in SHAPES]


def properties(shape):
    return case_schema()["$defs"][shape.__name__]["properties"]


def lengths(shape):
    """The keys of a shape's sizes; what is inside comes first."""
    fields = properties(shape).items()
    keys = [key for key, field in fields if field.get("unit") == "m"]
    return sorted(set(keys) - {"position"}, key=lambda key: "inner" not in key)


def example(shape):
    """A body with sizes of 4 mm and more, each larger than the one before."""
    sizes = {key: 4e-3 + 3e-3 * i for i, key in enumerate(lengths(shape))}
    name = properties(shape)["shape"]["const"]
    return {"name": "body", "shape": name, "material": "al-lee2003", **sizes}
