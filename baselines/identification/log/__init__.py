"""A log of a laboratory: its columns, its rows, and what is wrong with them."""
