"""The closed loop without Python: WebAssembly, a C library, an object for a microcontroller, FMUs, kernels for a GPU."""
