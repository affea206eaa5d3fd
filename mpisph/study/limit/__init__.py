"""The ballistic limit of a shield, found by bisection."""
