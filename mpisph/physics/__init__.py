"""The equations, one jitted function each, and the models of materials."""
