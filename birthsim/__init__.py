"""The command ``birthsim``: one door to what a user runs, above all other packages."""
