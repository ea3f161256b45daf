"""The paper: every printed number and statement against both models, and the values that it leaves out.

The main part judges numbers and statements; each other part answers one question that they raise, and has a
page of its own.
"""

MAIN = "main"
PARTS = {
    MAIN: "printed numbers, figures and statements",
    "identification": "geometry and parameters that are not printed",
    "nonlinear": "Lyapunov exponents",
    "reliability": "reliability in both models, and with a workpiece",
    "laws": "contact laws",
}
"""Part -> its subject. Its module has the same name, that of the main part is `study`."""
