"""Motion on a humanoid robot: its model, its joint angles, how good they are. Needs the extra ``motionloom[robots]``.

MuJoCo's world is used inside: +Z up, a robot faces +X, quaternions (w, x, y, z), radians and metres.
"""
