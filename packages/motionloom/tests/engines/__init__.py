"""Files as game engines and other programs play them: docs/engines."""
