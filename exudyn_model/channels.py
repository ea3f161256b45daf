"""Names of the channels, and their columns in the vector of values that is observed in each state."""

from exudyn_model.contact.states import CORNERS

STATE = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{part}" for corner in CORNERS for part in ("gap", "normal", "friction")
)
CHANNELS = STATE + ACCELERATIONS + CORNER_CHANNELS
REACTIONS = tuple(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy")
ENERGIES = tuple(
    f"energy_{name}" for name in ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
)

# Columns of the slider
SLIDER_X, SLIDER_Y, SLIDER_ANGLE, SLIDER_VX, SLIDER_VY, SLIDER_OMEGA = map(CHANNELS.index, STATE)
SLIDER_AX, SLIDER_AY, SLIDER_ALPHA = map(CHANNELS.index, ACCELERATIONS)
# Of the first contact; that of contact k is PER_CONTACT k further
PER_CONTACT = 3
GAP, NORMAL, FRICTION = map(CHANNELS.index, CORNER_CHANNELS[:PER_CONTACT])
# The first one of what a formulation adds
ADDED = len(CHANNELS)

# Among the energies
DRIVE, GRAVITY, KINETIC, CONTACT, DAMPING, DISSIPATED_BY_FRICTION, RESIDUAL = range(7)
