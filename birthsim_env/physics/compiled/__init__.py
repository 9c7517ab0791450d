"""How equations are compiled, over lanes, to the same bits everywhere."""
