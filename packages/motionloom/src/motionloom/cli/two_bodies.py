"""How near two people come to each other, as `motionloom duet` reports it."""

from collections.abc import Sequence

from motionloom.kinematics.capsules import DEEP, overlap, trunk_distance, wrist_distance
from motionloom.motion import Motion
from motionloom.retarget import joints22


def two_body_measures(duet: Sequence[Motion]) -> dict[str, float]:
    """How near the two bodies and their hands come, and how deep and in how many frames they are in each other."""

    first, second = (joints22(person) for person in duet)
    apart, depth = trunk_distance(first, second), overlap(first, second)
    hands = wrist_distance(first, second)
    return {
        "least_trunk_distance": round(float(apart.min()), 4),
        "trunk_distance": round(float(sorted(apart)[len(apart) // 2]), 4),
        "deepest_overlap": round(float(depth.max()), 4),
        "overlapping_frames": int((depth > DEEP).sum()),
        "least_wrist_distance": round(float(hands.min()), 4),
        "least_wrist_distance_at": round(float(hands.argmin()) / duet[0].fps, 3),
    }


def two_body_remarks(measures: Sequence[dict[str, float]]) -> list[str]:
    """A sentence for each duet whose bodies are in each other."""
    return [
        f"{f'duet {number}: ' if len(measures) > 1 else ''}the two are in each other by "
        f"{100 * one['deepest_overlap']:.0f} cm in {one['overlapping_frames']} frames"
        for number, one in enumerate(measures, 1)
        if one["overlapping_frames"]
    ]
