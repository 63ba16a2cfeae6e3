"""Text encoders: a sentence becomes one state per word piece and one pooled vector.

The embedded default is `MiniLM`; `PublishedText` opens what published weights were trained with.
"""
