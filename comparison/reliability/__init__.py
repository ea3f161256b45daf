"""How reliably the slider follows the ideal mechanism: the paper's reliability, and what qualifies it."""
