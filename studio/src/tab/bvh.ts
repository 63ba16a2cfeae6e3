/** A motion as BVH, as `motionloom.core.files.bvh_writer` writes it: metres, channels Z X Y. */

import { JOINTS, PARENTS } from "../body/skeleton";
import { type Body, REST } from "../prior/person";
import type { Turn, Vec } from "../prior/turns";

export function bvh({ fps, root, turns }: Body): string {
  const lines = ["HIERARCHY"];
  const order: number[] = [];
  const write = (joint: number, depth: number): void => {
    const [pad, children] = ["\t".repeat(depth), JOINTS.flatMap((_, n) => (PARENTS[n] === joint ? [n] : []))];
    const channels = joint ? "CHANNELS 3" : "CHANNELS 6 Xposition Yposition Zposition";
    order.push(joint);
    lines.push(`${pad}${joint ? "JOINT" : "ROOT"} ${JOINTS[joint]}`, `${pad}{`);
    lines.push(`${pad}\tOFFSET ${numbers(REST[joint]!)}`, `${pad}\t${channels} Zrotation Xrotation Yrotation`);
    for (const child of children) write(child, depth + 1);
    if (!children.length)
      lines.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET ${numbers(tip(joint))}`, `${pad}\t}`);
    lines.push(`${pad}}`);
  };
  write(0, 0);
  lines.push("MOTION", `Frames: ${root.length}`, `Frame Time: ${(1 / fps).toFixed(6)}`);
  root.forEach((place, f) =>
    lines.push(`${numbers(place)} ${order.map((j) => numbers(angles(turns[f]![j]!))).join(" ")}`),
  );
  return lines.join("\n") + "\n";
}

/** Half as long as the bone before it, in the same direction. */
function tip(joint: number): Vec {
  const [x, y, z] = REST[joint]!;
  return [x / 2, y / 2, z / 2];
}

/** Degrees about z, then x, then y. */
function angles([w, x, y, z]: Turn): Vec {
  const degrees = (radians: number): number => (radians * 180) / Math.PI;
  const middle = Math.asin(Math.min(Math.max(2 * (w * x + y * z), -1), 1));
  const first = Math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z));
  const last = Math.atan2(2 * (w * y - x * z), 1 - 2 * (x * x + y * y));
  return [degrees(first), degrees(middle), degrees(last)];
}

function numbers(values: readonly number[]): string {
  return values.map((value) => (Math.abs(value) < 5e-7 ? 0 : value).toFixed(6)).join(" ");
}
