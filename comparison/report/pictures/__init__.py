"""Pictures and animations of result tables, of one run or of two over each other."""
