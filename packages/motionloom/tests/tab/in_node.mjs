/** Draws in plain Node what `requests.json` in the weights' folder lists, and writes each motion's numbers there. */

import { readFileSync, writeFileSync } from "node:fs";
import { Prior } from "motionloom";

const folder = process.argv[2];
const prior = await Prior.load(folder);
const missed = [];
const requests = JSON.parse(readFileSync(`${folder}/requests.json`, "utf8"));
for (const [n, { words, ...options }] of requests.entries()) {
  let calls = 0;
  const motion = await prior.generate(words, {
    ...options,
    progress: () => (calls += 1),
  });
  for (const name of ["features", "positions", "rotations"])
    writeFileSync(`${folder}/${n}.${name}`, motion[name]);
  if (n === 0) writeFileSync(`${folder}/${n}.bvh`, motion.bvh());
  if (n === 0) {
    const [same] = await Promise.all([
      prior.generate(words, options),
      prior.generate("she jumps", { seconds: 1 }),
    ]);
    if (!same.positions.every((place, k) => place === motion.positions[k]))
      throw new Error("two at once are mixed up");
  }
  missed.push(motion.missed);
  if (calls !== 24 || motion.frames !== motion.positions.length / 66)
    throw new Error(`${calls} calls`);
}
const failed = {};
const refused = {
  seconds: [{ seconds: 11 }],
  seed: [{ seed: -1 }],
  path: [{ path: [[0, 0]] }],
};
for (const [name, [options]] of Object.entries(refused))
  await prior
    .generate("a person walks", options)
    .catch((error) => (failed[name] = error.message));
const stop = AbortSignal.abort();
await prior
  .generate("a person walks", { signal: stop })
  .catch((error) => (failed.signal = error.name));
await Prior.load(`${folder}/none`).catch(
  (error) => (failed.folder = error.message),
);
console.log(JSON.stringify({ about: prior.about, failed, missed }));
