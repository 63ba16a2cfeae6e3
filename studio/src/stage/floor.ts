/** The floor: a grid of metres that fades with the distance, numbers along the axes, and what takes shadows.
 *
 * Under feet it is darker, as it gets less light there: the closer they are, the more. */

import * as THREE from "three";
import type { Vec3 } from "../project/model";
import type { StageTheme } from "./theme";

const SIZE = 60;
const NUMBERED = 6;
/** Metres of a darker spot under a foot, and up to which an ankle darkens the floor. */
const [SPOT, NEAR] = [0.62, 0.5];

const GRID = /* glsl */ `
  uniform vec3 line, strong;
  uniform vec2 centre;
  varying vec3 place;
  float lines(vec2 at, float step, float width) {
    vec2 cell = at / step;
    vec2 edge = abs(fract(cell - 0.5) - 0.5) / max(fwidth(cell), 1e-5);
    return 1.0 - clamp(min(edge.x, edge.y) - width, 0.0, 1.0);
  }
  void main() {
    float fade = 1.0 - smoothstep(3.0, 15.0, length(place.xz - centre));
    float fine = lines(place.xz, 0.5, 0.0) * 0.35;
    float metre = lines(place.xz, 1.0, 0.0);
    vec2 toAxis = abs(place.xz) / max(fwidth(place.xz), vec2(1e-5));
    float axis = 1.0 - clamp(min(toAxis.x, toAxis.y) - 0.6, 0.0, 1.0);
    float shown = max(max(fine, metre), axis);
    gl_FragColor = vec4(mix(line, strong, axis), shown * fade);
    #include <colorspace_fragment>
  }
`;

const VERTEX = /* glsl */ `
  varying vec3 place;
  void main() {
    place = (modelMatrix * vec4(position, 1.0)).xyz;
    gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
  }
`;

export class Floor {
  readonly group = new THREE.Group();
  private readonly grid: THREE.ShaderMaterial;
  private readonly shadow = new THREE.ShadowMaterial({ opacity: 0.3 });
  private labels = new THREE.Group();
  private readonly soft = softSpot();
  private readonly spots: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>[] = [];

  constructor(theme: StageTheme) {
    const plane = new THREE.PlaneGeometry(SIZE, SIZE).rotateX(-Math.PI / 2);
    this.grid = new THREE.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: GRID,
      uniforms: {
        line: { value: new THREE.Color() },
        strong: { value: new THREE.Color() },
        centre: { value: new THREE.Vector2() },
      },
      transparent: true,
      depthWrite: false,
    });
    const grid = new THREE.Mesh(plane, this.grid);
    const ground = new THREE.Mesh(plane, this.shadow);
    ground.receiveShadow = true;
    ground.position.y = -0.001;
    grid.renderOrder = -1;
    this.group.add(ground, grid);
    this.look(theme);
  }

  /** The grid is there around a place. */
  centre(x: number, z: number): void {
    (this.grid.uniforms.centre!.value as THREE.Vector2).set(x, z);
  }

  /** Numbers are upright for a camera that looks there: radians from +Z towards +X. */
  face(yaw: number): void {
    for (const one of this.labels.children) one.rotation.y = yaw + Math.PI;
  }

  /** Darken the floor under these places. */
  stand(feet: readonly Vec3[]): void {
    while (this.spots.length < feet.length) this.spots.push(this.spot());
    this.spots.forEach((spot, index) => {
      const [x, y, z] = feet[index] ?? [0, NEAR, 0];
      spot.visible = y < NEAR;
      spot.position.set(x, 0.001, z);
      spot.material.opacity = this.shadow.opacity * (1 - Math.max(y, 0) / NEAR);
    });
  }

  private spot(): THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
    const material = new THREE.MeshBasicMaterial({ map: this.soft, transparent: true, depthWrite: false });
    const spot = new THREE.Mesh(new THREE.PlaneGeometry(SPOT, SPOT).rotateX(-Math.PI / 2), material);
    this.group.add(spot);
    return spot;
  }

  look(theme: StageTheme): void {
    this.grid.uniforms.line!.value.set(theme.line);
    this.grid.uniforms.strong!.value.set(theme.strong);
    this.shadow.opacity = theme.shadow;
    this.group.remove(this.labels);
    this.labels.traverse((one) => {
      if (one instanceof THREE.Mesh) {
        one.geometry.dispose();
        (one.material as THREE.MeshBasicMaterial).map?.dispose();
      }
    });
    this.labels = new THREE.Group();
    for (let metre = -NUMBERED; metre <= NUMBERED; metre += 1) {
      if (metre === 0) continue;
      this.labels.add(label(`${metre}`, metre, 0, theme), label(`${metre}`, 0, metre, theme));
    }
    this.labels.add(
      label("0 m", 0, 0, theme),
      label("x", NUMBERED + 0.5, 0, theme),
      label("z", 0, NUMBERED + 0.5, theme),
    );
    this.group.add(this.labels);
  }
}

/** A number that lies on the floor beside its line. */
function label(text: string, x: number, z: number, theme: StageTheme): THREE.Mesh {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [128, 64];
  const context = canvas.getContext("2d")!;
  context.font = "500 38px system-ui, sans-serif";
  context.fillStyle = theme.label;
  context.textBaseline = "middle";
  context.fillText(text, 8, 34);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  map.anisotropy = 4;
  const material = new THREE.MeshBasicMaterial({ map, transparent: true, depthWrite: false });
  const plane = new THREE.PlaneGeometry(0.36, 0.18).rotateX(-Math.PI / 2).translate(0.21, 0, 0.11);
  const mesh = new THREE.Mesh(plane, material);
  mesh.position.set(x, 0.002, z);
  return mesh;
}

/** Black that fades to the edge. */
function softSpot(): THREE.Texture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d")!;
  const fade = context.createRadialGradient(32, 32, 0, 32, 32, 32);
  fade.addColorStop(0, "#000c");
  fade.addColorStop(0.5, "#0004");
  fade.addColorStop(1, "#0000");
  context.fillStyle = fade;
  context.fillRect(0, 0, 64, 64);
  return new THREE.CanvasTexture(canvas);
}
