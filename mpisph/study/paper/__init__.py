"""The source paper's claims and tables, as answered by the studies."""
