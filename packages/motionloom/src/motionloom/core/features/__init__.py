"""Codecs between motions and the numbers that networks see, and the way back to a clean body.

`humanml` encodes and decodes the 263 numbers of HumanML3D, `layout` names them, `ik` turns decoded positions into a
`Motion` with true rotations, `feet` makes planted feet stay put.
"""
