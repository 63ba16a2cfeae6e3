// Poses to places, and places to a picture: forward kinematics, a camera that follows, a floor.
const multiply = ([a, b, c, d], [e, f, g, h]) =>
  [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];

const rotate = ([w, x, y, z], [a, b, c]) => {
  const u = 2 * (y * c - z * b), v = 2 * (z * a - x * c), t = 2 * (x * b - y * a);
  return [a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u];
};

// Places [x, y, z] of all joints in the world, metres.
export function places(skeleton, pose) {
  const world = [], found = [];
  skeleton.parents.forEach((parent, joint) => {
    world[joint] = parent < 0 ? pose.rotations[joint] : multiply(world[parent], pose.rotations[joint]);
    const arm = parent < 0 ? [0, 0, 0] : rotate(world[parent], skeleton.offsets[joint]);
    found[joint] = parent < 0 ? pose.root : arm.map((value, k) => value + found[parent][k]);
  });
  return found;
}

// A camera behind and above a target (x, z) that looks along `yaw` (radians; 0 is +z).
export class Camera {
  constructor(canvas) {
    Object.assign(this, { canvas, target: [0, 0], yaw: 0, distance: 5, height: 2.2, look: 0.9 });
  }

  follow([x, , z]) {
    this.target = [this.target[0] + 0.1 * (x - this.target[0]), this.target[1] + 0.1 * (z - this.target[1])];
  }

  axes() {
    const tilt = Math.atan2(this.height - this.look, this.distance);
    const [s, c, st, ct] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(tilt), Math.cos(tilt)];
    const forward = [s * ct, -st, c * ct];
    const eye = [this.target[0] - s * this.distance, this.height, this.target[1] - c * this.distance];
    return { eye, forward, right: [-c, 0, s], up: [s * st, ct, c * st], size: this.canvas.height * 1.1 };
  }

  // Pixels [x, y, depth] of a place, or null behind the camera.
  seen(place) {
    const { eye, forward, right, up, size } = this.axes();
    const ray = place.map((value, k) => value - eye[k]);
    const along = (axis) => axis[0] * ray[0] + axis[1] * ray[1] + axis[2] * ray[2];
    const depth = along(forward);
    if (depth < 0.1) return null;
    return [this.canvas.width / 2 + (along(right) / depth) * size, this.canvas.height / 2 - (along(up) / depth) * size, depth];
  }

  // The place [x, z] on the floor under a pixel, or null above the horizon.
  floor(px, py) {
    const { eye, forward, right, up, size } = this.axes();
    const a = (px - this.canvas.width / 2) / size, b = (this.canvas.height / 2 - py) / size;
    const ray = forward.map((value, k) => value + a * right[k] + b * up[k]);
    return ray[1] > -1e-3 ? null : [eye[0] - (ray[0] / ray[1]) * eye[1], eye[2] - (ray[2] / ray[1]) * eye[1]];
  }
}

// People (places of their joints, one after the other) on the floor, with crosses at the marks.
export function draw(camera, skeleton, people, marks) {
  const pen = camera.canvas.getContext("2d");
  pen.fillStyle = "#f6f8fb";
  pen.fillRect(0, 0, camera.canvas.width, camera.canvas.height);
  const line = (a, b, colour, width) => {
    const [p, q] = [camera.seen(a), camera.seen(b)];
    if (!p || !q) return;
    pen.strokeStyle = colour;
    pen.lineWidth = Math.max(1, (width * camera.canvas.height) / p[2]);
    pen.beginPath();
    pen.moveTo(p[0], p[1]);
    pen.lineTo(q[0], q[1]);
    pen.stroke();
  };
  pen.lineCap = "round";
  const [x, z] = camera.target.map(Math.round);
  for (let k = -8; k <= 8; k++) {
    for (let j = -8; j < 8; j++) {
      line([x + k, 0, z + j], [x + k, 0, z + j + 1], "#d5dde8", 0.004);
      line([x + j, 0, z + k], [x + j + 1, 0, z + k], "#d5dde8", 0.004);
    }
  }
  marks.forEach(([a, b]) => {
    line([a - 0.12, 0, b], [a + 0.12, 0, b], "#8a4fbf", 0.02);
    line([a, 0, b - 0.12], [a, 0, b + 0.12], "#8a4fbf", 0.02);
  });
  const bones = people.flatMap((found) => skeleton.parents.map((parent, joint) => [found, parent, joint]));
  const near = bones.filter(([, parent]) => parent >= 0);
  near.forEach(([found, parent, joint]) => {
    const [a, b] = [found[parent], found[joint]];
    line([a[0], 0, a[2]], [b[0], 0, b[2]], "#dfe5ee", 0.06);
  });
  const depth = ([found, , joint]) => camera.seen(found[joint])?.[2] ?? 0;
  near.sort((a, b) => depth(b) - depth(a)).forEach(([found, parent, joint]) => {
    const name = skeleton.names[joint].toLowerCase();
    const colour = name.includes("left") ? "#e8743b" : name.includes("right") ? "#2f6fd0" : "#6d7684";
    line(found[parent], found[joint], colour, name.includes("head") ? 0.16 : 0.075);
  });
}
