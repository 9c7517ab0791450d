"""Prebuilt kernels, ``make kernels``: which there are, their code for every target, and libraries that the package carries."""
