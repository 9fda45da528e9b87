// Visual meshes of a URDF: triangles of one colour that move with a row of the arm's table.
import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial } from 'three';
import { unpack } from './motion.js';

const CREASE = 0.8; // cosine: faces that meet at a sharper edge are not shaded as one

/** Return the geometry of a mesh; it is made once. */
function geometryOf(mesh) {
  if (mesh.geometry) return mesh.geometry;
  const points = unpack(mesh.points, mesh.count);
  const faces = unpack(mesh.faces, mesh.triangles).map((column) => column.map(Math.round));
  const count = mesh.triangles;
  const places = new Float32Array(9 * count);
  const areas = new Float32Array(3 * count); // the normal of each face, as long as twice its area
  const around = Array.from({ length: mesh.count }, () => []);
  for (let face = 0; face < count; face += 1) {
    faces.forEach((column, corner) => {
      around[column[face]].push(face);
      points.forEach((values, axis) => (places[9 * face + 3 * corner + axis] = values[column[face]]));
    });
    const edge = (corner, axis) => places[9 * face + 3 * corner + axis] - places[9 * face + axis];
    for (let axis = 0; axis < 3; axis += 1) {
      const [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
      areas[3 * face + axis] = edge(1, j) * edge(2, k) - edge(1, k) * edge(2, j);
    }
  }
  const normal = (face) => areas.subarray(3 * face, 3 * face + 3);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const lengths = Float32Array.from({ length: count }, (_, face) => Math.hypot(...normal(face)));
  const normals = new Float32Array(9 * count);
  for (let face = 0; face < count; face += 1) {
    faces.forEach((column, corner) => {
      const sum = [0, 0, 0];
      for (const near of around[column[face]]) {
        if (dot(normal(face), normal(near)) < CREASE * lengths[face] * lengths[near]) continue;
        normal(near).forEach((part, axis) => (sum[axis] += part));
      }
      const length = Math.hypot(...sum) || 1;
      sum.forEach((part, axis) => (normals[9 * face + 3 * corner + axis] = part / length));
    });
  }
  mesh.geometry = new BufferGeometry();
  mesh.geometry.setAttribute('position', new BufferAttribute(places, 3));
  mesh.geometry.setAttribute('normal', new BufferAttribute(normals, 3));
  return mesh.geometry;
}

/** Return a mesh as a part of an arm: in its colour, unless all of the arm has one material. */
export function partOf(mesh, materials) {
  const plain = materials.link === materials.dark || !mesh.color;
  if (!plain) mesh.material ??= new MeshStandardMaterial({ color: mesh.color, roughness: 0.5, metalness: 0.1 });
  const part = new Mesh(geometryOf(mesh), plain ? materials.link : mesh.material);
  part.castShadow = !part.material.transparent;
  return part;
}
