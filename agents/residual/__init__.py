"""What a residual is: what it sees, what it may do, the law inside."""
