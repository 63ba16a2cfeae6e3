"""Two people: from words, going on from both their motions, reacting to one, one of them on a path, a long duet.

python examples/12_duet.py
"""

from pathlib import Path

import numpy as np

from motionloom import Prior, load
from motionloom.core.models.pair import PairBlock
from motionloom.goals.goal_file import read_goal
from motionloom.goals.timeline import read_timeline
from motionloom.io import save_scene
from motionloom.tasks.duet import compose_pair, react
from motionloom.tasks.pair import complete_pair, generate_pair

here = Path(__file__).parent
prior = Prior.load()
block = PairBlock.load("duet", prior)

[dance] = generate_pair(prior, block, "two people dance salsa together", seconds=4.0, seed=1)
save_scene(dance, "dance.glb", names=["first", "second"])
save_scene(dance, "dance.png", names=["first", "second"])
apart = np.linalg.norm((dance[1].root - dance[0].root)[:, [0, 2]], axis=-1)
print(f"dance.glb, dance.png: {apart.min():.1f} to {apart.max():.1f} m from each other")

[longer] = complete_pair(prior, block, dance, "two people dance salsa together", seconds=2.0, seed=1)
same = all(np.array_equal(m.rotations[: len(old)], old.rotations) for m, old in zip(longer, dance, strict=True))
save_scene(longer, "longer.glb")
print(f"longer.glb: {longer[0].seconds:.1f} s, their past bit for bit: {same}")
assert same

given = load(here / "clips" / "walk.bvh")
[(first, second)] = react(prior, block, given, "two people walk together", seed=2)
save_scene([first, second], "answer.glb")
print(f"answer.glb: somebody for {first.seconds:.1f} s of a recorded walk")
assert first is given

goal = read_goal({"path": {"points": [[0, 0], [0.5, 1.5], [0, 3]]}}, frames=80, folder=here)
[led] = generate_pair(prior, block, "two people walk", goals=(goal, None), seed=3)
off = np.linalg.norm((led[0].root - goal.positions[:, 0])[:, [0, 2]], axis=-1).mean()
save_scene(led, "led.glb")
print(f"led.glb: the first is {100 * off:.1f} cm from the path in the mean")
assert off < 0.05

timeline = read_timeline(here / "timelines" / "duet.yaml")
long = compose_pair(prior, block, timeline.segments, seed=timeline.seed or 0)
save_scene(long, "long.glb")
print(f"long.glb: {long[0].seconds:.1f} s of {len(timeline.segments)} prompts")
