"""Reports: runs as one static HTML page."""
