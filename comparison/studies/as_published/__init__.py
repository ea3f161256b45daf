"""The printed figures by the paper's own formulation and solver, whose settings it does not print."""
