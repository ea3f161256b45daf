"""The six-bar press in Pinocchio: a model for sixbar-crossval, written from its page of equations alone.

=================  =======================================================================
module             sections of ``docs/model.md``
=================  =======================================================================
``linkage``        1, 2: closure of crank, rod 2 and rocker
``press``          3, 4: dynamics and joint forces by Pinocchio
``contact``        5, 6: corners of the slider, contact force, energy stored
``workpiece``      4: load of a workpiece
``motion``         6: memory of the impact speed, right-hand side, switching surfaces
``integration``    DOP853 from one switching instant to the next
``simulation``     8, 9: channels and contacts; the interface of ``docs/engine.md``
=================  =======================================================================

Points and vectors in the plane are complex numbers, x + iy.
"""

from pinocchio_press.simulation import simulate

__all__ = ["simulate"]
