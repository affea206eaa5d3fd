"""Material constants: the model, the cards shipped with mpisph, and quantities."""

from mpisph.materials.library import card_names, load_card, read_card
from mpisph.materials.model import Material

__all__ = ["Material", "card_names", "load_card", "read_card"]
