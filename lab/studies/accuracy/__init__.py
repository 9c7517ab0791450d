"""How exact the plant is."""
