"""Captions: mirrored, in everyday words, from index descriptions and from what a window measurably shows."""

import re
from collections.abc import Sequence

import numpy as np

_SWAPS = {
    "left": "right",
    "right": "left",
    "clockwise": "counterclockwise",
    "counterclockwise": "clockwise",
    "anticlockwise": "clockwise",
}
_SIDE = re.compile(r"\b(left|right|counter[- ]?clockwise|anti[- ]?clockwise|clockwise)\b", re.IGNORECASE)


def mirror_text(text: str) -> str:
    """Left and right, clockwise and counterclockwise exchanged: the caption of the mirrored motion."""

    def swap(match: re.Match[str]) -> str:
        word = match.group(0).lower().replace("-", "").replace(" ", "")
        other = _SWAPS[word]
        return other.capitalize() if match.group(0)[0].isupper() else other

    return _SIDE.sub(swap, text)


_PEOPLE = ("a person", "a person", "a person", "a person", "someone", "a man", "a woman", "the person", "a figure", "he", "she")


def sentence(verb_phrase: str, rng: np.random.Generator) -> str:
    """Put a subject before a verb phrase in the third person; sometimes leave the bare command instead."""
    if rng.random() < 0.12:
        return imperative(verb_phrase)
    return f"{_PEOPLE[rng.integers(len(_PEOPLE))]} {verb_phrase}"


_IRREGULAR = {"does": "do", "goes": "go", "is": "be", "has": "have", "punches": "punch", "crouches": "crouch", "reaches": "reach",
              "stretches": "stretch", "climbs": "climb", "waves": "wave", "raises": "raise", "dances": "dance", "moves": "move",
              "takes": "take", "rises": "rise", "paces": "pace", "strides": "stride", "circles": "circle", "boxes": "box",
              "ducks": "duck", "leaps": "leap", "washes": "wash", "poses": "pose", "balances": "balance", "continues": "continue",
              "makes": "make", "remains": "remain", "strikes": "strike", "performs": "perform", "throws": "throw"}  # fmt: skip


def imperative(verb_phrase: str) -> str:
    """'walks forward' to 'walk forward'; verbs after 'and' or 'then' follow."""

    def base(word: str) -> str:
        return _IRREGULAR.get(word, word[:-1] if word.endswith("s") and not word.endswith("ss") else word)

    words = verb_phrase.split(" ")
    return " ".join(base(w) if i == 0 or words[i - 1] in ("and", "then") else w for i, w in enumerate(words))


# What the CMU index and the Bandai-Namco names say, in verb phrases. First match wins; matched on the lowered description.
_INDEX: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("forward jumps, turn around", ("jumps forward several times and turns around", "jumps forward")),
    ("hang, swing", ("climbs, hangs and swings on a playground", "climbs up and swings")),
    ("climb, sit", ("climbs on a playground, sits and dangles the legs", "climbs up and sits down")),
    ("jump down", ("climbs up and jumps down", "climbs on a playground and jumps down")),
    ("playground - climb", ("climbs", "climbs up on a playground", "climbs up a ladder")),
    ("jump, balance", ("jumps and keeps the balance", "balances on one leg and jumps")),
    ("punch/strike", ("punches", "throws punches", "punches and strikes", "boxes")),
    ("boxing", ("boxes", "punches", "throws punches like a boxer")),
    ("swordplay", ("fights with a sword", "swings a sword")),
    ("wash self", ("washes the body", "washes as if in a shower")),
    ("uneven terrain", ("walks on uneven ground", "walks over rough terrain")),
    ("backward dribble", ("dribbles a basketball while walking backward",)),
    ("sideways dribble", ("dribbles a basketball while moving sideways",)),
    ("90-degree left turns", ("dribbles a basketball and turns left",)),
    ("90-degree right turns", ("dribbles a basketball and turns right",)),
    ("dribble, shoot", ("dribbles a basketball and shoots",)),
    ("dribble", ("dribbles a basketball", "dribbles a basketball while walking forward")),
    ("basketball signals", ("makes basketball signals with the arms", "signals with the arms like a referee")),
    ("navigate", ("walks forward, backward and sideways",)),
    ("kick ball", ("kicks a ball", "kicks a soccer ball", "kicks")),
    ("high stool, stand up", ("sits down on a stool and stands up", "sits on a chair and stands up again")),
    ("sit on stepstool, ankle", ("sits on a step stool with crossed legs and the chin in a hand", "sits and thinks")),
    ("stepstool, stand up", ("sits down on a low stool and stands up", "sits down and gets up again")),
    ("drink soda", ("drinks from a bottle", "drinks soda", "opens a bottle and drinks")),
    ("jump up to grab", ("jumps up to grab something", "reaches up high on tiptoe", "stretches up and jumps to reach something")),
    ("laugh", ("laughs", "laughs hard and bends over")),
    ("direct traffic, wave", ("directs traffic and waves", "waves and points", "waves with the arms")),
    ("jumping jacks", ("does gymnastics", "works out", "does exercises")),
    ("climb ladder", ("climbs a ladder", "climbs up a ladder")),
    ("climb 3 steps", ("climbs stairs", "walks up three steps", "climbs up steps and comes down again")),
    ("high jump", ("jumps high", "jumps up high")),
    ("forward jump", ("jumps forward", "takes a long jump forward")),
    ("hop on one foot", ("jumps up and down and hops on one foot",)),
    ("run, leap", ("runs and leaps", "runs and jumps")),
    ("jump", ("jumps", "jumps up")),
    ("wash windows", ("washes windows", "wipes a window")),
    ("mop floor", ("mops the floor", "cleans the floor with a mop")),
    ("walk, veer left", ("walks forward and veers left", "walks in a curve to the left")),
    ("walk, veer right", ("walks forward and veers right", "walks in a curve to the right")),
    ("walk, 90-degree left", ("walks forward and turns left", "walks and makes a left turn")),
    ("walk, 90-degree right", ("walks forward and turns right", "walks and makes a right turn")),
    ("slow walk, stop", ("walks slowly and stops",)),
    ("slow walk", ("walks slowly", "walks forward slowly")),
    ("exaggerated stride", ("walks with exaggerated strides", "walks with big steps")),
    ("walk stealthily", ("sneaks", "walks stealthily")),
    ("walk to run", ("walks and then runs", "starts to run")),
    ("sudden stop", ("runs and suddenly stops",)),
    ("quick stop", ("runs and stops quickly",)),
    ("run/jog, veer left", ("runs in a curve to the left", "jogs and veers left")),
    ("run/jog, veer right", ("runs in a curve to the right", "jogs and veers right")),
    ("run, veer left", ("runs in a curve to the left", "runs and veers left")),
    ("run, veer right", ("runs in a curve to the right", "runs and veers right")),
    ("90-degree left", ("runs and turns left",)),
    ("90-degree right", ("runs and turns right",)),
    ("run/jog", ("jogs", "jogs forward", "runs", "runs forward at an easy pace")),
    ("run side step left", ("runs and steps aside to the left",)),
    ("run side step right", ("runs and steps aside to the right",)),
    ("run turn left", ("runs and turns left",)),
    ("run turn right", ("runs and turns right",)),
    ("run left", ("runs to the left",)),
    ("run right", ("runs to the right",)),
    ("jump stop", ("runs, jumps and stops",)),
    ("run jump over", ("runs and jumps over something",)),
    ("run over", ("runs and leaps over something", "runs over an obstacle")),
    ("dive over roll", ("runs, dives and rolls on the floor",)),
    ("duck underneath", ("runs and ducks under something",)),
    ("run stop run", ("runs, stops and runs again",)),
    ("dash", ("runs fast", "sprints")),
    ("run", ("runs", "runs forward", "runs fast")),
    ("teapot", ("acts out a nursery rhyme with the arms",)),
    ("alaskan vacation", ("tells a story with gestures", "acts out a story")),
    ("prairie dog", ("acts like a prairie dog",)),
    ("whale", ("acts like a whale",)),
    ("bear", ("acts like a bear",)),
    ("dog", ("acts like a dog",)),
    ("fish", ("acts like a fish",)),
    ("elephant", ("acts like an elephant",)),
    ("chicken", ("acts like a chicken",)),
    ("dinosaur", ("acts like a dinosaur",)),
    ("snake", ("acts like a snake",)),
    ("monkey", ("acts like a monkey",)),
    ("cartwheel", ("does a cartwheel", "does cartwheels")),
    ("balance on one leg", ("balances on one leg with outstretched arms", "stands on one leg")),
    ("static dance pose", ("holds a dance pose", "stands in a dance pose")),
    ("spin/twirl", ("does acrobatics on ropes",)),
    ("salsa", ("dances salsa", "dances", "dances the salsa with a partner")),
    ("indian dance", ("dances", "performs an Indian dance", "dances with the arms and feet")),
    ("dance", ("dances", "dances ballet", "performs a dance")),
    ("front kick", ("does front kicks", "kicks forward", "kicks")),
    ("mawashigeri", ("does roundhouse kicks", "kicks to the side", "kicks")),
    ("yokogeri", ("does side kicks", "kicks sideways", "kicks")),
    ("oiduki", ("steps forward and punches", "does karate punches", "punches")),
    ("syutouuke", ("does karate blocks", "practises karate")),
    ("empi", ("practises karate", "does a karate form")),
    ("heiansyodan", ("practises karate", "does a karate form")),
    ("range of motion", ("stretches all limbs", "moves every joint")),
    ("motorcycle", ("stands with the arms held out to the sides",)),
    ("byebye", ("waves goodbye", "waves", "waves a hand")),
    ("bye", ("waves goodbye", "says goodbye with a wave")),
    ("bow", ("bows", "bends forward to bow")),
    ("call", ("calls somebody over with a wave of the hand",)),
    ("guide", ("shows the way with an arm", "points the way")),
    ("kick", ("kicks",)),
    ("punch", ("punches",)),
    ("respond", ("nods and responds",)),
    ("slash", ("slashes with a sword",)),
    ("walk back", ("walks backward", "walks backwards", "steps back")),
    ("walk left", ("walks sideways to the left", "walks to the left")),
    ("walk right", ("walks sideways to the right", "walks to the right")),
    ("turn left", ("walks and turns left", "turns left while walking")),
    ("turn right", ("walks and turns right", "turns right while walking")),
    ("raise up both hands", ("raises both hands", "raises both arms", "lifts both arms up")),
    ("raise up left hand", ("raises the left hand", "lifts the left arm")),
    ("raise up right hand", ("raises the right hand", "lifts the right arm")),
    ("wave both hands", ("waves both hands", "waves with both hands", "waves")),
    ("wave left hand", ("waves the left hand", "waves with the left hand", "waves")),
    ("wave right hand", ("waves the right hand", "waves with the right hand", "waves")),
    ("walk", ("walks", "walks forward", "walks straight ahead")),
)  # fmt: skip

_STYLES = {
    "active": "energetically", "angry": "angrily", "childish": "like a child", "chimpira": "like a thug", "feminine": "in a feminine way",
    "giant": "like a giant", "happy": "happily", "masculine": "in a masculine way", "musical": "to music", "unconfident": "timidly",
    "elderly": "like an old person", "proud": "proudly", "sad": "sadly", "tired": "tiredly", "exhausted": "exhaustedly", "youthful": "youthfully",
}  # fmt: skip


def describe_index(description: str) -> tuple[str, ...]:
    """Verb phrases in everyday words for a description of the pack's index; empty where there is nothing to say."""
    lowered = description.lower()
    found = next((phrases for key, phrases in _INDEX if key in lowered), ())
    style = next((word for key, word in _STYLES.items() if f"{key} style" in lowered or f"({key})" in lowered), None)
    return found if style is None else (*found, *(f"{phrase} {style}" for phrase in found))


LABELS: dict[str, tuple[str, ...]] = {
    "walk": ("walks forward", "walks", "is walking forward", "walks straight ahead", "walks at a normal pace", "takes several steps forward", "walks in a straight line", "strolls forward"),
    "walk slow": ("walks slowly", "walks forward slowly", "strolls slowly", "takes slow steps forward"),
    "walk fast": ("walks quickly", "walks forward at a fast pace", "walks briskly", "strides forward"),
    "jog": ("jogs", "jogs forward", "is jogging", "runs slowly", "jogs in a straight line", "goes for a jog"),
    "run": ("runs", "runs forward", "is running", "runs fast", "sprints forward", "runs straight ahead", "runs quickly"),
    "walk backward": ("walks backward", "walks backwards", "steps backward", "moves backwards", "walks in reverse", "takes several steps back", "goes backward"),
    "jog backward": ("jogs backward", "runs backwards", "runs backward"),
    "sidestep left": ("walks sideways to the left", "sidesteps to the left", "steps sideways to the left", "walks sideways", "moves sideways to the left", "walks sideways", "side steps"),
    "sidestep right": ("walks sideways to the right", "sidesteps to the right", "steps sideways to the right", "walks sideways", "moves sideways to the right", "walks sideways", "side steps"),
    "turn left": ("turns left", "turns to the left", "makes a left turn", "rotates to the left", "turns around to the left"),
    "turn right": ("turns right", "turns to the right", "makes a right turn", "rotates to the right", "turns around to the right"),
    "walk left turn": ("walks forward and turns left", "turns left while walking", "walks and turns to the left", "turns left", "walks and makes a left turn"),
    "walk right turn": ("walks forward and turns right", "turns right while walking", "walks and turns to the right", "turns right", "walks and makes a right turn"),
    "turn around": ("turns around", "turns around and faces the other way", "walks and turns around", "does a half turn"),
    "circle left": ("walks in a circle", "walks in a circle to the left", "walks in a counterclockwise circle", "walks around in a circle", "circles to the left"),
    "circle right": ("walks in a circle", "walks in a circle to the right", "walks in a clockwise circle", "walks around in a circle", "circles to the right"),
    "run circle": ("runs in a circle", "jogs in a circle", "runs around in a circle"),
    "stand": ("stands still", "stands", "is standing still", "stands in place", "does not move", "stays where they are", "stands upright and waits"),
    "jump": ("jumps", "jumps up", "jumps once", "jumps into the air", "leaps up"),
    "jump forward": ("jumps forward", "takes a long jump", "leaps forward", "jumps"),
    "jump repeatedly": ("jumps up and down", "keeps jumping", "jumps several times", "jumps in place", "jumps"),
    "hop": ("hops", "hops on one leg", "hops on one foot", "hops up and down on one foot", "keeps hopping"),
    "jumping jacks": ("does jumping jacks", "does star jumps", "jumps while raising the arms"),
    "punch": ("punches", "throws a punch", "punches forward", "throws punches", "boxes", "punches with the fists"),
    "kick": ("kicks", "kicks forward", "does a kick", "kicks with one leg", "kicks high"),
    "kick ball": ("kicks a ball", "kicks", "kicks something with the foot"),
    "wave": ("waves", "waves a hand", "waves with one hand", "waves hello", "waves at somebody", "waves goodbye"),
    "arms up": ("raises both arms", "raises the arms", "lifts both arms above the head", "puts both hands up", "raises both hands over the head", "raises both arms up in the air"),
    "one arm up": ("raises one arm", "lifts a hand up", "raises a hand above the head"),
    "bend": ("bends down", "bends forward", "bends over", "bends down to the floor", "leans down", "bends down to pick something up"),
    "sit": ("sits", "sits down", "sits on a chair", "is sitting", "takes a seat", "sits down on a chair"),
    "stand up": ("stands up", "gets up from a chair", "rises from a seat"),
    "crouch": ("crouches", "crouches down", "squats", "squats down", "does squats", "bends the knees and lowers the body"),
    "climb": ("climbs", "climbs up", "climbs a ladder", "climbs stairs", "walks up the stairs", "climbs up steps", "climbs up something"),
    "descend": ("climbs down", "goes down", "walks down the stairs", "comes down from a ladder"),
    "dance": ("dances", "is dancing", "dances around", "performs a dance", "dances with the whole body"),
    "balance": ("balances on one leg", "stands on one leg", "balances on one foot"),
    "cartwheel": ("does a cartwheel", "does cartwheels"),
    "crawl": ("crawls", "crawls on the floor", "moves on all fours"),
}  # fmt: skip
"""Verb phrases for what a window measurably shows; see `data.windows`."""


def phrases(label: str) -> Sequence[str]:
    """The wordings of a measured label; two labels joined by '+' happen at once."""
    if "+" not in label:
        return LABELS[label]
    first, second = label.split("+", 1)
    return [f"{a} and {b}" for a in LABELS[first][:4] for b in LABELS[second][:5]]
