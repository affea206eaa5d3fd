"""The discretisation: neighbours, pair sums, rates, stepping."""
