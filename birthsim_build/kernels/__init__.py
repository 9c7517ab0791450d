"""Prebuilt kernels: which there are, their code for every target, and the libraries that the package carries (``make kernels``)."""
