"""Tables of other programs: any column names, any units, with a mapping to our channels.

`units` and `mapping` say what is meant, `exports` and `matlab` how a file is laid out, `tables` joins them.
"""
