"""Material constants: the model, the cards shipped with mpisph, and quantities."""

from mpisph.materials.library import card_names, load_card
from mpisph.materials.model import Material, Tillotson

__all__ = ["Material", "Tillotson", "card_names", "load_card"]
