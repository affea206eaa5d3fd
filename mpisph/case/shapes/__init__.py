"""The shapes of bodies, one file each; `bodies.SHAPES` lists them."""
