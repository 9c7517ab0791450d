"""All derivatives: of kernels, traced and written as code of their own; of the plant, of a loop on a tape; linear models."""
