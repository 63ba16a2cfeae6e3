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
    const [, face] = meshes(figure).filter((one) => one.parent === meshes(figure).at(-8)!.parent);
    const middle = new Box3().setFromObject(face!, true).getCenter(new Vector3());
    expect(middle.z).toBeGreaterThan(PLACES[HEAD]![2] + 0.04);
    const hands = figure.group.children.filter((one) => one.children.length === 2).slice(1);
    [LEFT, RIGHT].forEach(({ wrist }, n) => {
      const [hand, thumb] = hands[n]!.children.map((one) => new Box3().setFromObject(one, true));
      expect(thumb!.max.z).toBeGreaterThan(hand!.max.z);
      // The fingers bend to the palm, which is to the thigh.
      expect(Math.abs(hand!.getCenter(new Vector3()).x)).toBeLessThan(Math.abs(PLACES[wrist]![0]) + 0.012);
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
    for (const { geometry, scale } of meshes(posed(PLACES)).slice(0, 6)) {
      const [places, normals] = [geometry.getAttribute("position"), geometry.getAttribute("normal")];
      const middle = new Box3().setFromBufferAttribute(places as never).getCenter(new Vector3());
      let outwards = 0;
      for (let n = 0; n < places.count; n += 1) {
        const out = new Vector3().fromBufferAttribute(places, n).sub(middle);
        outwards += Math.sign(out.dot(new Vector3().fromBufferAttribute(normals, n)));
      }
      expect(outwards * scale.z).toBeGreaterThan(places.count * 0.6);
    }
  });
});
