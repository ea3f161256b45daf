"""Import of tables of other programs: any column names and units, with a mapping to the channels.

`source` reads a file as it is (`text`, `excel`, `matlab`); `reading` finds out which column is which channel.
"""
