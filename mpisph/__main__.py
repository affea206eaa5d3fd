"""``python -m mpisph`` does what ``mpisph`` does."""

from mpisph.cli import main

main()
