"""The body that a GLB shows is a closed one of human size."""

import numpy as np

from motionloom.io.body import body
from motionloom.skeleton import SMPL22
from tests.io.gltf_files import person


def test_the_body_is_closed_faces_outward_and_has_human_size() -> None:
    pieces = body(person())
    rest = SMPL22.rest_positions()
    for piece in pieces:
        a, b, c = (piece.points[piece.triangles[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a) * (a - piece.points.mean(axis=0))).sum() > 0  # six times the volume
        edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in piece.triangles for k in range(3)}
        assert {(b, a) for a, b in edges} == edges  # every edge is shared by two faces that turn alike
    points = np.concatenate([p.points + rest[p.joint] for p in pieces])
    tall, wide = np.ptp(points[:, 1]), np.ptp(points[:, 0])
    assert 1.5 < tall < 1.9
    assert 1.2 < wide < 2.0
    assert points[:, 1].min() > -0.08
    assert {p.side for p in pieces} == {-1, 0, 1, 2}
