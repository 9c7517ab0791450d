"""How many small changes of the numerical modules their tests notice."""
