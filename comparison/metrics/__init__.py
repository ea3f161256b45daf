"""How large a difference is and what else is told of it: pure functions on arrays and tables."""
