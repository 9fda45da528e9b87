// The view of the arm in space: camera, light, floor, ghosts, and what can be shown or hidden.
import {
  Color, DirectionalLight, GridHelper, Group, HemisphereLight, Mesh, MeshBasicMaterial, MeshStandardMaterial,
  PCFShadowMap, PerspectiveCamera, PlaneGeometry, Scene, ShadowMaterial, Sphere, SphereGeometry, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Arm, axesOf } from './arm.js';
import { Labels, worldPlace } from './labels.js';
import { Loads } from './load.js';
import { SCENE } from './theme.js';
import { Trace } from './trace.js';
import { Zones } from './zones.js';

const MOST_GHOSTS = 10;
const VIEWS = { corner: [1, -1.45, 0.75], front: [1, 0, 0.0001], side: [0, -1, 0.0001], top: [0.0001, 0, 1] };

/** Return the length of a cell of the grid, m: 1, 2 or 5 times a power of ten. */
function cellFor(size) {
  const power = 10 ** Math.floor(Math.log10(size / 4));
  return [5, 2, 1].map((factor) => factor * power).find((cell) => cell <= size / 4) ?? power;
}

export class Stage {
  constructor(holder, scene, motion, theme, other) {
    this.other = other;
    this.holder = holder;
    this.motion = motion;
    this.theme = theme;
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.domElement.setAttribute('aria-label', 'The arm in space');
    this.renderer.domElement.setAttribute('role', 'img');
    holder.prepend(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(38, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.materials = {
      link: new MeshStandardMaterial({ roughness: 0.45, metalness: 0.1 }),
      joint: new MeshStandardMaterial({ roughness: 0.4, metalness: 0.1 }),
      prismatic: new MeshStandardMaterial({ roughness: 0.4, metalness: 0.1 }),
      dark: new MeshStandardMaterial({ roughness: 0.6, metalness: 0.2 }),
    };
    this.arm = new Arm(scene.robot, this.materials, true);
    this.scene.add(this.arm.root);
    this.trace = new Trace(scene.tool, motion, 0.0027 * this.arm.size, theme);
    this.scene.add(this.trace.line);
    this.labels = new Labels(holder);
    this.loads = new Loads(scene.loads, this.arm, this.labels, motion.end);
    this.addWaypoints(scene.waypoints);
    this.addOther(scene.other);
    this.zones = new Zones(scene.zones, this.arm.size);
    this.scene.add(this.zones.group);
    this.bounds = this.boundsOf();
    this.addLights();
    this.addFloor();
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.draw());
    this.controls.addEventListener('start', () => (this.untouched = false));
    this.look('corner');
    this.paint();
    theme.listen(() => this.paint());
    new ResizeObserver(() => this.resize()).observe(holder);
    this.resize();
  }

  /** Show ghosts of the arm at waypoints, and a dot where the tool is at each of them. */
  addWaypoints(waypoints) {
    this.ghosts = new Group();
    this.dots = new Group();
    this.scene.add(this.ghosts, this.dots);
    // Depth first: of all ghosts only the nearest surface shows, and no parts inside.
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 8 }; // the arm itself, where both are
    const depth = new MeshBasicMaterial({ colorWrite: false, transparent: true, ...behind });
    this.ghostMaterial = new MeshStandardMaterial({ transparent: true, opacity: 0.22, roughness: 0.8, depthWrite: false, ...behind });
    this.dotMaterial = new MeshBasicMaterial();
    const ball = new SphereGeometry(0.0085 * this.arm.size, 20, 14);
    const stride = Math.max(1, Math.ceil(waypoints.length / MOST_GHOSTS));
    const one = this.ghostMaterial;
    this.names = [];
    waypoints.forEach(({ time, joints, name }, index) => {
      const ghost = new Arm(this.arm.robot, { link: one, joint: one, prismatic: one, dark: one });
      ghost.mountAt(time, true);
      ghost.move(joints);
      const dot = new Mesh(ball, this.dotMaterial);
      dot.position.copy(ghost.toolPosition());
      this.dots.add(dot);
      if (name) this.names.push(this.labels.add(name, worldPlace(dot), 'point'));
      if (index % stride === 0) this.ghosts.add(ghost.root);
    });
    const parts = [];
    this.ghosts.traverse((part) => part.isMesh && parts.push(part));
    for (const part of parts) {
      part.renderOrder = 2;
      const first = new Mesh(part.geometry, depth);
      first.renderOrder = 1;
      first.visible = part.visible;
      part.add(first);
    }
  }

  /** Add the arm of a second motion, translucent, and its path. */
  addOther(scene) {
    this.otherParts = [];
    this.otherMaterial = new MeshStandardMaterial({ transparent: true, opacity: 0.5, roughness: 0.8, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 8 });
    if (!scene?.robot) return;
    const one = this.otherMaterial;
    this.otherArm = new Arm(scene.robot, { link: one, joint: one, prismatic: one, dark: one });
    this.otherTrace = new Trace(scene.tool, this.other, 0.0013 * this.arm.size, this.theme, (name) => SCENE[name].other);
    this.otherParts = [this.otherArm.root, this.otherTrace.line];
    this.scene.add(...this.otherParts);
  }

  /** Return a ball around all that the arm does. */
  boundsOf() {
    const points = [];
    for (let k = 0; k <= 24; k += 1) {
      this.arm.move(this.motion.joints(this.motion.start + ((this.motion.end - this.motion.start) * k) / 24));
      points.push(...this.arm.extremes());
    }
    points.push(...this.trace.points, ...(this.otherTrace?.points ?? []));
    const base = new Vector3().setFromMatrixPosition(this.arm.root.children[0].matrixWorld);
    points.push(base);
    this.floor = Math.min(0, base.z);
    this.points = points;
    const bounds = new Sphere().setFromPoints(points);
    bounds.radius = Math.max(bounds.radius, 0.25 * this.arm.size) * 1.08;
    return bounds;
  }

  addLights() {
    const { center, radius } = this.bounds;
    this.sky = new HemisphereLight();
    this.sky.position.set(0, 0, 1);
    this.sun = new DirectionalLight();
    this.sun.position.set(center.x + radius, center.y - 1.4 * radius, center.z + 3 * radius);
    this.sun.target.position.copy(center);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    const { camera } = this.sun.shadow;
    const wide = 1.5 * radius;
    Object.assign(camera, { left: -wide, right: wide, top: wide, bottom: -wide, near: 0.1 * radius, far: 8 * radius });
    this.sun.shadow.radius = 4;
    this.sun.shadow.normalBias = 0.012 * radius;
    this.sun.shadow.bias = -2e-4;
    this.scene.add(this.sky, this.sun, this.sun.target);
  }

  addFloor() {
    const { center, radius } = this.bounds;
    this.cell = cellFor(2 * radius);
    const half = Math.ceil((1.35 * radius) / this.cell);
    this.grid = new Group();
    this.lines = new GridHelper(2 * half * this.cell, 2 * half);
    this.lines.rotation.x = Math.PI / 2;
    this.grid.add(this.lines);
    const shade = new Mesh(new PlaneGeometry(12 * radius, 12 * radius), new ShadowMaterial());
    shade.position.z = -1e-3 * radius;
    shade.receiveShadow = true;
    this.shade = shade;
    const at = (value) => Math.round(value / this.cell) * this.cell;
    this.grid.position.set(at(center.x), at(center.y), this.floor);
    this.grid.add(shade);
    const axes = axesOf(0.14 * this.arm.size);
    axes.position.z = 2e-3 * radius;
    this.world = axes;
    this.scene.add(this.grid, axes);
  }

  /** Give everything the colours of the theme. */
  paint() {
    const colors = SCENE[this.theme.name];
    this.scene.background = new Color(colors.background);
    for (const [name, material] of Object.entries(this.materials)) material.color.set(colors[name]);
    this.ghostMaterial.color.set(colors.ghost);
    this.ghostMaterial.emissive.set(colors.ghost).multiplyScalar(0.35);
    this.dotMaterial.color.set(colors.waypoint);
    this.loads.material.color.set(colors.load);
    this.zones.paint(colors);
    this.otherMaterial.color.set(colors.other);
    this.otherTrace?.paint();
    this.shade.material.opacity = colors.shadow;
    Object.assign(this.sky, { color: new Color(colors.sky), groundColor: new Color(colors.ground), intensity: colors.fill });
    this.sun.intensity = colors.sun;
    this.paintGrid(colors);
    this.trace.paint();
    this.draw();
  }

  /** Colour the grid: the lines through the world's origin are stronger. */
  paintGrid({ grid, gridMain }) {
    const color = this.lines.geometry.getAttribute('color');
    const place = this.lines.geometry.getAttribute('position');
    const { x, y } = this.grid.position;
    for (let k = 0; k < color.count; k += 2) {
      // Both ends of a line; the grid lies in the plane x, z of its own frame, and is turned by a right angle.
      const [ax, az, bx, bz] = [place.getX(k), place.getZ(k), place.getX(k + 1), place.getZ(k + 1)];
      const main = (ax === bx && Math.abs(ax + x) < 1e-3 * this.cell) || (az === bz && Math.abs(az - y) < 1e-3 * this.cell);
      const { r, g, b } = new Color(main ? gridMain : grid);
      for (const end of [k, k + 1]) color.setXYZ(end, r, g, b);
    }
    color.needsUpdate = true;
  }

  /** Turn the camera to one of the views, so that the whole motion can be seen. */
  look(name) {
    const { center, radius } = this.bounds;
    const direction = new Vector3(...VIEWS[name]).normalize();
    this.view = name;
    this.controls.target.copy(center);
    this.camera.near = radius / 100;
    this.camera.far = radius * 60;
    this.camera.updateProjectionMatrix();
    let [near, far] = [radius, 12 * radius];
    for (let k = 0; k < 24; k += 1) {
      const middle = (near + far) / 2;
      if (this.seesAll(center, direction, middle)) far = middle;
      else near = middle;
    }
    this.seesAll(center, direction, far);
    this.untouched = true;
    this.controls.update();
  }

  /** Move the camera to a distance, and return whether it sees all of the motion. */
  seesAll(center, direction, distance) {
    this.camera.position.copy(center).addScaledVector(direction, distance);
    this.camera.lookAt(center);
    this.camera.updateMatrixWorld(true);
    const [across, up] = [1 - 2 * Math.min(0.06, 36 / this.holder.clientWidth), 1 - 2 * Math.min(0.14, 52 / this.holder.clientHeight)];
    return this.points.every((point) => {
      const { x, y, z } = point.clone().project(this.camera);
      return Math.abs(x) <= across && Math.abs(y) <= up && z < 1;
    });
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.untouched) this.look(this.view);
    this.render(); // at once: a canvas of a new size is empty
  }

  /** Show or hide a part: 'ghosts', 'frames', 'trace', 'zones', 'grid' or 'other'. */
  show(part, visible) {
    const parts = { ghosts: [this.ghosts], frames: this.arm.axes, trace: [this.trace.line, this.dots], grid: [this.grid, this.world], zones: [this.zones.group], other: this.otherParts };
    for (const object of parts[part]) object.visible = visible;
    if (part === 'trace') for (const name of this.names) name.hidden = !visible;
    this.draw();
  }

  seek(time) {
    this.arm.mountAt(time);
    this.arm.move(this.motion.joints(time));
    this.otherArm?.mountAt(time - this.other.start);
    this.otherArm?.move(this.other.joints(time));
    this.loads.seek(time);
    this.draw();
  }

  /** Draw with the next frame of the screen, once. */
  draw() {
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame(() => {
      this.wanted = false;
      this.render();
    });
  }

  render() {
    this.renderer.render(this.scene, this.camera);
    this.labels.place(this.camera, this.holder.clientWidth, this.holder.clientHeight);
  }
}
