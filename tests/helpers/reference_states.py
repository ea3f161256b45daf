"""Changes that select each formulation of the reference, for each of its joints with clearance."""

IDEAL, PIN = {"joints.slider": "ideal"}, {"joints.crank_pin": "clearance"}
MULTIPLIER = {"solver.reference.formulation": "multiplier"}
EACH = {
    "slider": {},
    "ideal": IDEAL,
    "pin": IDEAL | PIN,
    "both": PIN,
    "multiplier": MULTIPLIER,
    "multiplier ideal": MULTIPLIER | IDEAL,
}
