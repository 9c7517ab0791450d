"""Built code of every target, against Python."""
