"""A planar linkage as rigid bodies with joints in implicit steps: the formulation "full".

It is built from lists of bodies, pins, guides, contacts and a drive (``system``), of which those of the press
are one case. Steps are short in contacts and long in flight (``settings``), but equal where nothing has
clearance.
"""
