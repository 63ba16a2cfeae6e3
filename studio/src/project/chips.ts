/** Sentences to begin with, each with a seed; `tests/studio/test_start.py` measures that the motion does what they say. */

export const CHIPS = [
  { text: "a person walks, turns around and waves", seed: 8 },
  { text: "a person walks forward, then sits down", seed: 3 },
  { text: "a person picks something up off the floor and walks on", seed: 1 },
  { text: "a child skips along happily", seed: 1 },
  { text: "a person is doing jumping jacks", seed: 1 },
  { text: "a person claps their hands", seed: 1 },
] as const;
