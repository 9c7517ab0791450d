"""The paper's law, and its form in Cartesian coordinates."""
