"""Times of the kernels beside other people's code and the machine's own limits."""
