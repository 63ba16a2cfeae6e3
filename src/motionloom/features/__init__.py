"""Codecs between motions and the numbers that networks see."""
