"""Result tables: channels over time with events and extrema; reading, validation, alignment in time.

`channels` names what a table may hold; `result` and `table` check it, `table_files` reads and writes it;
`times` and `align` bring two of them onto one grid. Of other programs' tables `formats` opens the file,
`dialect` and `heading` read text, `units` and `mapping` tell what a column means, and `foreign` makes tables
of them.
"""
