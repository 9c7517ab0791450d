"""Derivatives of kernels: their source is traced to a graph, differentiated there and written as loops over lanes."""
