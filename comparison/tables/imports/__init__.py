"""Import of tables of other programs: any column names and units, with a mapping to the channels.

`units` and `mapping` define the meaning of columns, `exports` and `matlab` the file layout; `text` combines
them.
"""
