import { Box3, BufferGeometry, Mesh, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { HEAD, LEFT, RIGHT } from "../src/body/skeleton";
import { Mannequin } from "../src/stage/mannequin";

const LOOK = { body: "#ffffff", joints: "#888888", opacity: 1 };
/** Somebody who hangs his arms and faces +Z, half of the body: [x, y, z] of each joint. */
const PLACES: readonly (readonly [number, number, number])[] = [
  [0, 0.97, 0], [0.07, 0.89, 0], [-0.07, 0.89, 0], [0, 1.1, -0.02], [0.07, 0.49, 0], [-0.07, 0.49, 0],
  [0, 1.24, -0.02], [0.07, 0.06, -0.03], [-0.07, 0.06, -0.03], [0, 1.3, -0.02], [0.08, 0, 0.1], [-0.08, 0, 0.1],
  [0, 1.51, -0.04], [0.08, 1.41, -0.03], [-0.08, 1.41, -0.03], [0, 1.6, 0.01], [0.2, 1.44, -0.04], [-0.2, 1.44, -0.04],
  [0.24, 1.18, -0.05], [-0.24, 1.18, -0.05], [0.26, 0.92, 0.02], [-0.26, 0.92, 0.02],
]; // prettier-ignore

function posed(places: readonly (readonly number[])[]): Mannequin {
  const figure = new Mannequin(LOOK);
  figure.pose(places.flat());
  figure.group.updateMatrixWorld(true);
  return figure;
}

function meshes(figure: Mannequin): Mesh<BufferGeometry>[] {
  const found: Mesh<BufferGeometry>[] = [];
  figure.group.traverse((one) => one instanceof Mesh && found.push(one));
  return found;
}

/** The middle of the face, from the joint of the head. */
function face(figure: Mannequin): Vector3 {
  const [, found] = meshes(figure).filter((one) => one.parent === meshes(figure).at(-8)!.parent);
  return new Box3()
    .setFromObject(found!, true)
    .getCenter(new Vector3())
    .sub(new Vector3(...PLACES[HEAD]!));
}

describe("the mannequin", () => {
  it("stands on the floor with its soles flat, and is as tall as a person", () => {
    const box = new Box3().setFromObject(posed(PLACES).group, true);
    expect(box.max.y).toBeGreaterThan(1.72);
    expect(box.max.y).toBeLessThan(1.86);
    expect(box.min.y).toBeGreaterThan(-0.03);
    expect(box.max.x).toBeCloseTo(-box.min.x, 3);
  });

  it("looks where it faces, with thumbs in front and palms inwards", () => {
    const figure = posed(PLACES);
    expect(face(figure).z).toBeGreaterThan(0.04);
    const hands = figure.group.children.filter((one) => one.children.length === 2).slice(1);
    [LEFT, RIGHT].forEach(({ wrist }, n) => {
      const [hand, thumb] = hands[n]!.children.map((one) => new Box3().setFromObject(one, true));
      expect(thumb!.max.z).toBeGreaterThan(hand!.max.z);
      // The fingers bend to the palm, which is to the thigh.
      expect(Math.abs(hand!.getCenter(new Vector3()).x)).toBeLessThan(Math.abs(PLACES[wrist]![0]) + 0.012);
    });
  });

  it("turns its face where the head looks, and to the front without that", () => {
    const figure = posed(PLACES);
    const turned = (look: readonly number[] | null) => {
      figure.pose(PLACES.flat(), look);
      figure.group.updateMatrixWorld(true);
      return face(figure);
    };
    const [front, left, down] = [turned(null), turned([0.8, 0, 0.6]), turned([0, -0.6, 0.8])];
    expect(Math.abs(front.x)).toBeLessThan(0.002);
    expect(left.x).toBeGreaterThan(0.03);
    expect(left.y).toBeCloseTo(front.y, 1);
    expect(down.y).toBeLessThan(front.y - 0.02);
    expect(Math.abs(down.x)).toBeLessThan(0.002);
    expect(turned(null).distanceTo(front)).toBeLessThan(1e-6);
  });

  it("has round shoulders that slope to the neck where arms hang down", () => {
    const arms = meshes(posed(PLACES)).filter((_, n) => n === 2 || n === 4);
    arms.forEach(({ geometry }, n) => {
      const [shoulder, places] = [
        new Vector3(...PLACES[[LEFT, RIGHT][n]!.shoulder]!),
        geometry.getAttribute("position"),
      ];
      const all = Array.from({ length: places.count }, (_, k) => new Vector3().fromBufferAttribute(places, k));
      const top = all.reduce((one, other) => (other.y > one.y ? other : one));
      expect(Math.abs(top.x)).toBeLessThan(Math.abs(shoulder.x) - 0.02);
      const around = all.filter((one) => one.y < shoulder.y - 0.02 && one.y > shoulder.y - 0.08);
      const depths = around.map((one) => one.z);
      expect(Math.max(...depths) - Math.min(...depths)).toBeGreaterThan(0.114);
    });
  });

  it("has skins without gaps or faults in every bend, of few triangles", () => {
    const crouched = PLACES.map(([x, y, z], joint) =>
      joint === 4 || joint === 5 ? [x, y, 0.35] : y > 0.5 ? [x, y - 0.55, z - 0.1] : [x, y, z],
    );
    for (const places of [PLACES, crouched, PLACES.map(() => [0, 0, 0])]) {
      const all = meshes(posed(places));
      for (const { geometry } of all)
        for (const name of ["position", "normal"])
          expect(geometry.getAttribute(name).array.every((value) => Number.isFinite(value))).toBe(true);
      const triangles = all.reduce((sum, { geometry }) => sum + geometry.index!.count / 3, 0);
      expect(triangles).toBeLessThan(8000);
    }
  });

  it("turns its skin outwards", () => {
    for (const { geometry } of meshes(posed(PLACES)).slice(0, 6)) {
      const [places, normals, index] = [
        geometry.getAttribute("position"),
        geometry.getAttribute("normal"),
        geometry.index!,
      ];
      let [volume, outwards] = [0, 0];
      for (let n = 0; n < index.count; n += 3) {
        const corners = [0, 1, 2].map((k) => new Vector3().fromBufferAttribute(places, index.getX(n + k)));
        const [a, b, c] = corners as [Vector3, Vector3, Vector3];
        volume += a.dot(b.clone().cross(c)) / 6;
        const out = b.clone().sub(a).cross(c.clone().sub(a));
        outwards += Math.sign(out.dot(new Vector3().fromBufferAttribute(normals, index.getX(n))));
      }
      expect(volume).toBeGreaterThan(0.001);
      expect(outwards).toBeGreaterThan((index.count / 3) * 0.85);
    }
  });
});
