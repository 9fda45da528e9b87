// Zones about corners: a translucent ball at each, and the programmed path within them in dashes.
import { CylinderGeometry, Group, InstancedMesh, Mesh, MeshBasicMaterial, Object3D, SphereGeometry, Vector3 } from 'three';

const UP = new Vector3(0, 1, 0);

/** Return the dashes of a line through points, each as long as the gaps: pairs of ends of straight parts. */
function dashesOf(points, length) {
  const dashes = [];
  let walked = 0;
  for (let k = 1; k < points.length; k += 1) {
    let from = points[k - 1];
    let left = from.distanceTo(points[k]);
    while (left > 1e-12) {
      const run = Math.floor(walked / length + 1e-9);
      const step = Math.min(left, length * (run + 1) - walked);
      const to = from.clone().lerp(points[k], step / left);
      if (run % 2 === 0) dashes.push([from, to]);
      walked += step;
      left -= step;
      from = to;
    }
  }
  return dashes;
}

export class Zones {
  /**
   * @param {object[]} zones Each with a ball [x, y, z, radius] or null, and the programmed positions of the tool, m.
   * @param {number} size Of the arm, m.
   */
  constructor(zones, size) {
    this.group = new Group();
    this.ballMaterial = new MeshBasicMaterial({ transparent: true, opacity: 0.26, depthWrite: false });
    this.lineMaterial = new MeshBasicMaterial();
    const sphere = new SphereGeometry(1, 32, 20);
    for (const { ball } of zones) {
      if (!ball) continue;
      const mesh = new Mesh(sphere, this.ballMaterial);
      mesh.position.set(...ball);
      mesh.scale.setScalar(ball[3]);
      mesh.renderOrder = 4;
      this.group.add(mesh);
    }
    const parts = zones.flatMap(({ programmed }) => {
      const points = programmed.map((place) => new Vector3(...place));
      const length = points.reduce((sum, point, k) => sum + (k ? point.distanceTo(points[k - 1]) : 0), 0);
      return length > 1e-9 ? dashesOf(points, Math.max(length / 25, 1e-6)) : [];
    });
    this.dashes = new InstancedMesh(new CylinderGeometry(1, 1, 1, 6), this.lineMaterial, Math.max(parts.length, 1));
    this.dashes.count = parts.length;
    this.dashes.frustumCulled = false;
    const part = new Object3D();
    parts.forEach(([from, to], index) => {
      const axis = new Vector3().subVectors(to, from);
      part.position.addVectors(from, to).multiplyScalar(0.5);
      part.scale.set(0.0016 * size, Math.max(axis.length(), 1e-9), 0.0016 * size);
      part.quaternion.setFromUnitVectors(UP, axis.normalize());
      part.updateMatrix();
      this.dashes.setMatrixAt(index, part.matrix);
    });
    this.group.add(this.dashes);
  }

  paint({ zone, programmed }) {
    this.ballMaterial.color.set(zone);
    this.lineMaterial.color.set(programmed);
  }
}
