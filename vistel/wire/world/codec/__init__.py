"""The world's frames: where things are and who touches what, as changes to what was said before.

`bits` writes numbers of any size, `poses` rounds and predicts where things are, `touches` keeps who touches whom, `frame`
puts them together. docs/reference/world-stream.md tells it all for whoever writes another decoder. Whole numbers only, so
that every machine gives the same bits.
"""
