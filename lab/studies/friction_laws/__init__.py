"""Controllers on frictions that they do not expect."""
