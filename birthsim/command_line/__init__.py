"""How commands are found, begun and ended, and the options that they share."""
