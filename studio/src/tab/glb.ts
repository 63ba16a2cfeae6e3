/** A motion as GLB: bones with a plain body on them, and one animation. */

import * as THREE from "three";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import { JOINTS, PARENTS } from "../body/skeleton";
import { type Body, REST } from "../prior/person";

export async function glb(body: Body, name: string): Promise<ArrayBuffer> {
  const bones = JOINTS.map((joint) => Object.assign(new THREE.Bone(), { name: joint }));
  bones.forEach((bone, joint) => {
    bone.position.set(...REST[joint]!);
    if (joint) bones[PARENTS[joint]!]!.add(bone);
  });
  const mesh = new THREE.SkinnedMesh(figure(), new THREE.MeshStandardMaterial({ color: "#dcc8a6", roughness: 0.7 }));
  mesh.name = "person";
  mesh.add(bones[0]!);
  mesh.updateMatrixWorld(true);
  mesh.bind(new THREE.Skeleton(bones));
  const scene = new THREE.Scene().add(mesh);
  const exporter = new GLTFExporter();
  const made = await exporter.parseAsync(scene, {
    binary: true,
    animations: [animation(body, name)],
    onlyVisible: false,
  });
  return made as ArrayBuffer;
}

function animation({ fps, root, turns }: Body, name: string): THREE.AnimationClip {
  const times = root.map((_, f) => f / fps);
  const turned = JOINTS.map((joint, j) => {
    const values = turns.flatMap((frame) => [frame[j]![1], frame[j]![2], frame[j]![3], frame[j]![0]]);
    return new THREE.QuaternionKeyframeTrack(`${joint}.quaternion`, times, values);
  });
  return new THREE.AnimationClip(name, root.length / fps, [
    new THREE.VectorKeyframeTrack(`${JOINTS[0]}.position`, times, root.flat()),
    ...turned,
  ]);
}

/** Four-sided double pyramids along the bones in rest pose, each on the joint it hangs on. */
function figure(): THREE.BufferGeometry {
  const places: THREE.Vector3[] = [];
  REST.forEach((offset, joint) => {
    const place = new THREE.Vector3(...offset);
    places.push(joint ? place.add(places[PARENTS[joint]!]!) : place);
  });
  const [points, on]: [number[], number[]] = [[], []];
  places.slice(1).forEach((end, n) => {
    const parent = PARENTS[n + 1]!;
    const start = places[parent]!;
    const way = end.clone().sub(start);
    const side = new THREE.Vector3(0, 0, 1).cross(way).normalize();
    const front = way.clone().normalize().cross(side);
    const middle = start.clone().addScaledVector(way, 0.25);
    const ring = [0, 1, 2, 3].map((k) =>
      middle
        .clone()
        .addScaledVector(side, 0.035 * Math.cos((k * Math.PI) / 2))
        .addScaledVector(front, 0.035 * Math.sin((k * Math.PI) / 2)),
    );
    ring.forEach((corner, k) => {
      const next = ring[(k + 1) % 4]!;
      for (const one of [start, next, corner, corner, next, end]) {
        points.push(...one.toArray());
        on.push(parent);
      }
    });
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  geometry.setAttribute(
    "skinIndex",
    new THREE.Uint16BufferAttribute(
      on.flatMap((joint) => [joint, 0, 0, 0]),
      4,
    ),
  );
  geometry.setAttribute(
    "skinWeight",
    new THREE.Float32BufferAttribute(
      on.flatMap(() => [1, 0, 0, 0]),
      4,
    ),
  );
  geometry.computeVertexNormals();
  return geometry;
}
