"""The code that needs no Python, beside Python."""
