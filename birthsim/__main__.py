"""``python -m birthsim``: the command without its script."""

from birthsim.main import main

if __name__ == "__main__":
    main()
