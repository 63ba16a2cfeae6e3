/** Round skins over rings: a body's limbs, which bend with their joints, and whatever keeps its form. */

import * as THREE from "three";

/** Where the skin goes around something: half as wide along `side` as along what is square to it and to the way. */
export interface Ring {
  readonly at: THREE.Vector3;
  readonly side: THREE.Vector3;
  readonly wide: number;
  readonly deep: number;
  /** Metres that its middle is in front of `at`. */
  readonly ahead?: number;
}

const [TANGENT, SIDE, AHEAD, ALONG, AROUND] = Array.from({ length: 5 }, () => new THREE.Vector3());

/** A skin over a number of rings, each of as many points. */
export class Loft {
  readonly geometry = new THREE.BufferGeometry();
  private readonly places: THREE.BufferAttribute;
  private readonly normals: THREE.BufferAttribute;

  constructor(
    private readonly rings: number,
    private readonly points: number,
  ) {
    this.places = new THREE.BufferAttribute(new Float32Array(rings * points * 3), 3);
    this.normals = new THREE.BufferAttribute(new Float32Array(rings * points * 3), 3);
    const index: number[] = [];
    for (let ring = 0; ring < rings - 1; ring += 1)
      for (let n = 0; n < points; n += 1) {
        const [a, b] = [ring * points + n, ring * points + ((n + 1) % points)];
        index.push(a, a + points, b, b, a + points, b + points);
      }
    this.geometry.setIndex(index).setAttribute("position", this.places).setAttribute("normal", this.normals);
  }

  /** Put the skin over its rings; `floor`: nothing of it is lower (of what keeps its form). */
  over(rings: readonly Ring[], floor = -Infinity): this {
    rings.forEach(({ at, side, wide, deep, ahead = 0 }, ring) => {
      const before = rings[Math.max(ring - 1, 0)]!.at;
      TANGENT.copy(rings[Math.min(ring + 1, rings.length - 1)]!.at)
        .sub(before)
        .normalize();
      SIDE.copy(side).addScaledVector(TANGENT, -side.dot(TANGENT)).normalize();
      AHEAD.crossVectors(SIDE, TANGENT);
      for (let n = 0; n < this.points; n += 1) {
        const angle = (n / this.points) * 2 * Math.PI;
        const place = ALONG.copy(at)
          .addScaledVector(SIDE, wide * Math.cos(angle))
          .addScaledVector(AHEAD, ahead + deep * Math.sin(angle));
        this.places.setXYZ(ring * this.points + n, place.x, Math.max(place.y, floor), place.z);
      }
    });
    this.shade(rings);
    this.places.needsUpdate = this.normals.needsUpdate = true;
    return this;
  }

  /** Normals of the grid of points; a ring of no width is the end of the skin. */
  private shade(rings: readonly Ring[]): void {
    const point = (ring: number, n: number, out: THREE.Vector3) =>
      out.fromBufferAttribute(this.places, ring * this.points + ((n + this.points) % this.points));
    for (let ring = 0; ring < this.rings; ring += 1) {
      const [before, behind] = [Math.max(ring - 1, 0), Math.min(ring + 1, this.rings - 1)];
      const isEnd = rings[ring]!.wide === 0;
      for (let n = 0; n < this.points; n += 1) {
        point(behind, n, ALONG).sub(point(before, n, SIDE));
        point(ring, n + 1, AROUND).sub(point(ring, n - 1, SIDE));
        if (isEnd)
          SIDE.copy(rings[behind]!.at)
            .sub(rings[before]!.at)
            .multiplyScalar(ring ? 1 : -1);
        else SIDE.crossVectors(ALONG, AROUND);
        SIDE.normalize();
        this.normals.setXYZ(ring * this.points + n, SIDE.x, SIDE.y, SIDE.z);
      }
    }
  }
}

/** What keeps its form, along +Y: [height, half width along X, half depth along Z, how far ahead] of each ring. */
export function solid(rings: readonly (readonly [number, number, number, number?])[], points: number): Loft {
  const side = new THREE.Vector3(1, 0, 0);
  return new Loft(rings.length, points).over(
    rings.map(([y, wide, deep, ahead = 0]) => ({ at: new THREE.Vector3(0, y, 0), side, wide, deep, ahead })),
  );
}
