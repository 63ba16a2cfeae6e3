"""Takes: motions that were made, of which one is shown."""

import json

from . import actions


def add(settings, name, *, seed, parts, remarks, pieces):
    """Remember a take and show it. parts: (armature, action) of each person; pieces: (name, first, last frame)."""
    take = settings.takes.add()
    take.name, take.seed, take.remark, take.pieces = name, min(seed, 2**31 - 1), "; ".join(remarks), json.dumps(pieces)
    for armature, action in parts:
        part = take.parts.add()
        part.armature, part.action = armature, action
    settings.take_at = len(settings.takes) - 1


def show(settings):
    """Let the armatures play the chosen take, as an action or as NLA strips."""
    if not 0 <= settings.take_at < len(settings.takes):
        return
    take = settings.takes[settings.take_at]
    for part in take.parts:
        if part.armature is None or part.action is None:
            continue
        actions.clear_strips(part.armature)
        if settings.output == "NLA":
            actions.strips(part.armature, part.action, json.loads(take.pieces))
        else:
            actions.play(part.armature, part.action)


def shown(settings, armature):
    """The action that an armature plays: its own, else that of the take which is shown as strips; or None."""
    if armature.animation_data is not None and armature.animation_data.action is not None:
        return armature.animation_data.action
    if 0 <= settings.take_at < len(settings.takes):
        for part in settings.takes[settings.take_at].parts:
            if part.armature == armature:
                return part.action
    return None


def pieces_of(settings, action):
    """(name, first, last frame) of the blocks of an action."""
    for take in settings.takes:
        if any(part.action == action for part in take.parts):
            return json.loads(take.pieces)
    return [[action.name, *(round(at) for at in action.frame_range)]]
