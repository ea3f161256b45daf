"""Columns of the arrays that the kernels read and write. SI units, times in s from t = 0.

The kernels take plain arrays of numbers: one array a contact law, one row a contact's memory.
"""

# ---- A contact law: see `parameters.Contact`. The geometry stands last: of a slider, or of a journal.
(
    LAW,
    SHARED,  # 1: the side of a slider remembers its touch, not the corner
    STIFFNESS,
    EXPONENT,
    DAMPING,  # c_max of the law "adams-impact", N s/m; of the others the factor C of Eq. 11
    DAMPING_DEPTH,  # Only of the law "adams-impact"
    SPEED_FLOOR,
    FRICTION_COEFFICIENT,
    STATIC_SPEED,
    TRANSITION_SPEED,
    SIDE_STIFFNESS,
    CLEARANCE,
    MASS,  # of the body that the contact carries
    HALF_WIDTH,
    HALF_LENGTH,
    ACROSS_X,  # unit vector across the guide, and its direction
    ACROSS_Y,
    DIRECTION,
    BEARING_RADIUS,
) = range(19)
LAW_COLUMNS = 19

# ---- The memory of a contact: of a corner of a slider, or of a journal. See `memory`.
(
    GAP,
    RATE,
    SLIP,  # where friction acts
    NORMAL,
    FRICTION,
    CLOSED,  # 1: inside the wall
    IMPACT_SPEED,  # 0: no contact is in progress
    START,
    NAME,  # row whose name the contact in progress bears in the table of contacts
    END,  # of the last contact, or when a corner of a side in contact last came out
    STORED,  # energy of the contact, or of the side in the row of its lower corner; dissipated powers
    DAMPING_POWER,
    FRICTION_POWER,
    REGIME,  # of a journal's friction in an iteration: see `laws.slip_regime`
) = range(14)
MEMORY_COLUMNS = 14
