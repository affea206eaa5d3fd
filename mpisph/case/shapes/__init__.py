"""The shapes of bodies, one file each; `bodies.SHAPES` lists them.

A new shape is a new file and an entry of that list. The file holds a `Shape`: its sizes
as fields, its section, and how to describe it. The section is an `Annulus`, a
`Rectangle`, or a new `Section`, of which only the radii at each height and a few sizes
must be given.
"""
