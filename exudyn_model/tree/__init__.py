"""The coordinates that the drive leaves free, in explicit steps with error control: formulation "tree".

Rod 4 and slider, or, where the crank pin has clearance, all bodies but the crank (``building``). Steps end
where a contact begins or ends (``steps``).
"""
