/** Lines of even width in pixels. */

import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import type { Vec3 } from "../project/model";

export class Line {
  readonly object: Line2;

  constructor(color: string, width: number, opacity = 1) {
    const material = new LineMaterial({ color, linewidth: width, transparent: opacity < 1, opacity });
    this.object = new Line2(new LineGeometry(), material);
    this.object.frustumCulled = false;
    this.object.visible = false;
  }

  color(color: string): void {
    this.object.material.color.set(color);
  }

  through(points: readonly Vec3[]): void {
    this.object.visible = points.length > 1;
    if (points.length < 2) return;
    this.object.geometry.dispose();
    this.object.geometry = new LineGeometry().setPositions(points.flat());
  }
}
