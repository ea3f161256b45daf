"""Forces of the guide and of the crank pin, and the memory of the contacts (Eqs. 1-14, Figs. 7, 8).

Five bodies and trees share these kernels: ``corners`` and ``journal`` have the forces in a trial state of a
step, ``memory`` what five bodies keep from step to step; the trees freeze impact speeds themselves.
"""
