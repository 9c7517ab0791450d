"""The closed loop without Python: as WebAssembly, as a shared library for C, and as an object for a microcontroller."""
