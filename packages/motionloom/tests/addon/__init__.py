"""The Blender extension in Blender, against a real server."""
