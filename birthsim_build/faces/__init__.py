"""What users of the machine code see: a C header, a JavaScript module, and how to build with them."""
