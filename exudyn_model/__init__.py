"""A planar six-bar press in Exudyn, with clearance between slider and guide.

Equation, section and table numbers are those of Zuo et al., Lubricants 2025, 13(6), 246. Written without
knowledge of ``reference_model``; the two share only the scene's numbers. Where to find what:

- ``parameters``: the numbers of a scene in SI units (Tables 1, 2).
- ``scene_reading``: these from the plain mapping; stiffnesses K, K_s, damping factor (Eqs. 8, 10, 11).
- ``assembly``: joints of the linkage (Eq. 16), initial positions and velocities; what cannot be assembled.
- ``mechanism``: Exudyn's nodes, bodies, joints, drive, gravity and the objects that carry the contacts.
- ``point_contact``: normal force and friction of one point (Eqs. 9-11, 13, 14), the speed at the instant of
  touch. ``side_law``: the three laws for two corners of one side (Eqs. 7, 8).
- ``contact``: gaps of the four corners, the user function that Exudyn calls; ``journal``: the same for the
  crank pin. ``plain_contact``, ``plain_journal``: both in plain Python. ``native_contact``: the corners by
  Exudyn's own contact object.
- ``contact_memory``: freezes and forgets impact speeds from accepted states; the table of contacts.
- ``accelerations``: the slider's accelerations by balance of forces at one state (Eqs. 15-21, reduced);
  ``loose_pin``: the same where the crank pin has clearance.
- ``energy``: work, stored and dissipated energy, and what is left of their balance.
- ``recording``: samples, contacts and extrema of a run. ``tables``: names of channels, the final tables.
- ``solver_choice``: formulation, method and settings of a scene. ``solver``: every setting of Exudyn's
  implicit solver with its reason; the run itself.
- ``tree``: the other formulation, for an ideal crank pin: rod 4 and slider alone in the frame of the rocker's
  tip (``rocker_tip``). ``rocker_tree``: the same for a loose one: all bodies but the crank.
- ``tree_motion``, ``tree_forces``, ``tree_observation``: state of either tree within a step, the forces and
  accelerations in it, all channels. ``touch_location``, ``tree_recording``, ``tree_solver``: steps with error
  control, which end where a contact begins or ends, and what is kept of them.
- ``gap_acceleration``, ``gap_search``: how far a gap can bend within a step of a tree, and where it passes
  through zero, so that no contact is missed.
- ``watch``, ``invariants``: what no correct run can show, looked at in every run; bounds with their reasons.
- ``simulation``: from the scene's mapping to the result.
- ``compiled``: numba with a cache that notices every change of this package.
"""

from exudyn_model.simulation import Result, simulate

__all__ = ["Result", "simulate"]
