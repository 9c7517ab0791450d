"""``python -m birthsim``: the command without its script."""

from birthsim.door import main

if __name__ == "__main__":
    main()
