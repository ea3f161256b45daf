"""A planar linkage as rigid bodies with joints in implicit steps: the formulation "full".

It is built from lists of bodies, pins, guides, springs, contacts and a drive (``system``): those of the
press, or those of a scene that states its bodies (``linkage_scene``, ``linkage_recording``). Steps are short
in contacts and long in flight (``settings``), but equal where nothing has clearance.
"""
