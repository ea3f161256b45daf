"""What the paper does not print but other printed figures imply: the press's geometry, and how surely."""
