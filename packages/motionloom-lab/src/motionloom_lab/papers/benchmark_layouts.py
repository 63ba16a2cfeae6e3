"""The skeletons of the prediction benchmarks, as published systems see them: from the root, +Z up, no way through
the world. The order of the joints is that of the files that HumanMAC and the systems before it read."""

from motionloom.features.positions import Layout

H36M_LAYOUT = Layout(
    names=(
        "hip",
        "right_hip",
        "right_knee",
        "right_ankle",
        "left_hip",
        "left_knee",
        "left_ankle",
        "spine",
        "thorax",
        "neck",
        "head",
        "left_shoulder",
        "left_elbow",
        "left_wrist",
        "right_shoulder",
        "right_elbow",
        "right_wrist",
    ),
    parents=(-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 9, 8, 11, 12, 8, 14, 15),
    pairs=(0, 4, 5, 6, 1, 2, 3, 7, 8, 9, 10, 14, 15, 16, 11, 12, 13),
    root=False,
    z_up=True,
)
"""Human3.6M, 17 of its 32 joints (Martinez et al. 2017); 16 of them have numbers."""

HUMANEVA_LAYOUT = Layout(
    names=(
        "pelvis",
        "thorax",
        "left_shoulder",
        "left_elbow",
        "left_wrist",
        "right_shoulder",
        "right_elbow",
        "right_wrist",
        "left_hip",
        "left_knee",
        "left_ankle",
        "right_hip",
        "right_knee",
        "right_ankle",
        "head",
    ),
    parents=(-1, 0, 1, 2, 3, 1, 5, 6, 0, 8, 9, 0, 11, 12, 1),
    pairs=(0, 1, 5, 6, 7, 2, 3, 4, 11, 12, 13, 8, 9, 10, 14),
    root=False,
    z_up=True,
)
"""HumanEva-I, 15 joints; 14 of them have numbers."""
