// Choices of a header, one of which the kernel narrows.
// Built for: V = 1 4 8 16; FORM = 0 1 2
