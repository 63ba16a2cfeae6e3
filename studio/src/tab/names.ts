/** Which bone of a humanoid a name means (`motionloom.retarget.names`). */

/** Words of each part in order of preference: an earlier word wins where a skeleton has several. */
const SIDED = {
  hip: ["upleg", "upperleg", "thigh", "femur", "hip"],
  knee: ["lowerleg", "lowleg", "loleg", "shin", "calf", "tibia", "knee", "leg"],
  ankle: ["ankle", "foot"],
  foot: ["toebase", "toe", "toes", "ball", "foot"],
  collar: ["clavicle", "collar", "collarbone", "innershoulder", "shoulder"],
  shoulder: ["upperarm", "uparm", "humerus", "shldr", "arm", "shoulder"],
  elbow: ["lowerarm", "lowarm", "loarm", "forearm", "elbow", "radius"],
  wrist: ["hand", "wrist", "palm"],
} as const;
const MIDDLE = { pelvis: ["pelvis", "hips", "hip", "lowertorso"], head: ["head"] } as const;
const LETTERS = { left: ["left", "l", "lt", "lft"], right: ["right", "r", "rt", "rgt"] } as const;
const NOISE = new Set(
  (
    "bip bip001 biped mixamorig cc rl base armature character skeleton skel " +
    "robot jnt joint bone bn def org rig valve sim avg c j m f bip01"
  ).split(" "),
);
const HELPERS = new Set("twist roll ik fk pole end nub tip site target effector share corrective".split(" "));
const WORDS = [...Object.values(SIDED), ...Object.values(MIDDLE)].flat() as string[];

/** VRM's names of the bones, and the parts that they are. */
const VRM = {
  UpperLeg: "hip",
  LowerLeg: "knee",
  Foot: "ankle",
  Toes: "foot",
  Shoulder: "collar",
  UpperArm: "shoulder",
  LowerArm: "elbow",
  Hand: "wrist",
} as const;

/** "left_knee" of VRM's "leftLowerLeg"; of the trunk pelvis and head alone, the bones between them are seen in the tree. */
export function ofVrm(bone: string): string | null {
  if (bone === "hips") return "pelvis";
  if (bone === "head") return "head";
  const [, side, part] = /^(left|right)([A-Z]\w*)$/.exec(bone) ?? [];
  return part && part in VRM ? `${side}_${VRM[part as keyof typeof VRM]}` : null;
}

/** "left", "right" or "" and the word that is left of a name; no word: nothing that is looked for. */
function read(name: string): [string, string] {
  const bare = name
    .split(/[:|]/)
    .at(-1)!
    .replace(/^bip(?:ed)?0*1?(?=[\s_])/i, "");
  let tokens = (bare.match(/[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+/g) ?? []).map((one) => one.toLowerCase());
  let side = "";
  for (const [own, marks] of Object.entries(LETTERS)) {
    const at = tokens.findIndex((one) => (marks as readonly string[]).includes(one));
    if (side || at < 0) continue;
    side = own;
    tokens = tokens.filter((one) => !(marks as readonly string[]).includes(one));
  }
  tokens.forEach((token, n) => {
    for (const [own, marks] of Object.entries(LETTERS))
      for (const mark of [...marks].sort((a, b) => b.length - a.length))
        if (!side && token.startsWith(mark) && WORDS.includes(token.slice(mark.length)))
          [side, tokens[n]] = [own, token.slice(mark.length)];
  });
  const numbered = tokens.some((one) => /^\d+$/.test(one) && !["0", "00", "1", "01"].includes(one));
  if (numbered || tokens.some((one) => HELPERS.has(one))) return [side, ""];
  return [side, tokens.filter((one) => !/^\d+$/.test(one) && !NOISE.has(one)).join("")];
}

/** Numbers of the bones by part, such as "left_knee" or "pelvis"; names of which parents come first. */
export function partsByName(names: readonly (readonly [number, string])[]): Map<string, number> {
  const found = new Map<string, number>();
  for (const [number, name] of names) {
    const key = read(name).join(" ");
    if (!found.has(key)) found.set(key, number);
  }
  const parts = new Map<string, number>();
  const choose = (side: string, part: string, words: readonly string[]): void => {
    const word = words.find((one) => found.has(`${side} ${one}`));
    if (word) parts.set(side ? `${side}_${part}` : part, found.get(`${side} ${word}`)!);
  };
  for (const [part, words] of Object.entries(MIDDLE)) choose("", part, words);
  for (const side of ["left", "right"]) {
    for (const [part, words] of Object.entries(SIDED)) choose(side, part, words);
    for (const [lower, upper] of [
      ["foot", "ankle"],
      ["collar", "shoulder"],
    ] as const)
      if (parts.get(`${side}_${lower}`) === parts.get(`${side}_${upper}`)) parts.delete(`${side}_${lower}`);
    if (!parts.has(`${side}_hip`) && found.has(`${side} leg`) && found.has(`${side} knee`)) {
      parts.set(`${side}_hip`, found.get(`${side} leg`)!);
      parts.set(`${side}_knee`, found.get(`${side} knee`)!);
    }
  }
  return parts;
}
