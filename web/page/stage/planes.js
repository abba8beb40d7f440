// Endless planes: a fine grid that fades, and the shadows that fall on it. Rooms: the edges where walls meet.
import * as THREE from 'three';

const kMostCuts = 12;
const kReach = 14;   // radii of the scene that a plane is drawn for

const kVertex = `
  varying vec2 place;
  varying vec3 worldPlace;
  void main() {
    place = position.xy;
    worldPlace = (modelMatrix * vec4(position, 1.0)).xyz;`;
const kUniforms = `
  varying vec2 place;
  varying vec3 worldPlace;
  uniform vec4 walls[WALLS];
  uniform float cell, reach, strength;
  uniform vec3 ink, paper;
  float lines(vec2 at, float size) {
    vec2 grid = at / size;
    vec2 width = fwidth(grid);
    vec2 near = abs(fract(grid - 0.5) - 0.5) / max(width, 1e-6);
    float line = 1.0 - min(min(near.x, near.y), 1.0);
    return line * clamp(0.7 - 1.4 * max(width.x, width.y), 0.0, 1.0);
  }`;
const kCut = `
  for (int wall = 0; wall < WALLS; ++wall) {
    if (dot(worldPlace, walls[wall].xyz) < walls[wall].w) discard;
  }`;
/// The shadow lies over the grid, in one pass for both.
const kBlend = `
  float far = length(place) / reach;
  float line = max(0.45 * lines(place, cell), lines(place, 5.0 * cell));
  float glow = 0.5 * exp(-60.0 * far * far);
  float drawn = (1.0 - smoothstep(0.05, 1.0, far)) * max(strength * line, glow);
  float shaded = gl_FragColor.a;
  float covered = shaded + drawn * (1.0 - shaded);
  gl_FragColor = vec4(mix(paper, ink, line) * drawn * (1.0 - shaded) / max(covered, 1e-4), covered);
  #include <colorspace_fragment>`;

function planeMaterial(uniforms) {
  const material = new THREE.ShadowMaterial({depthWrite: false});
  material.uniforms = uniforms;
  material.defines = {WALLS: uniforms.walls.value.length};
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader.replace('void main() {', kVertex);
    shader.fragmentShader = shader.fragmentShader.replace('void main() {', `${kUniforms}\nvoid main() {${kCut}`)
        .replace('#include <tonemapping_fragment>', '').replace('#include <colorspace_fragment>', kBlend);
  };
  return material;
}

/// A plane in the world: all x with normal.x = offset.
function wallOf(body) {
  const [x, y, z, qw, qx, qy, qz] = body.pose;
  const normal = new THREE.Vector3(...body.form.normal).applyQuaternion(new THREE.Quaternion(qx, qy, qz, qw)).normalize();
  return {normal, offset: body.form.offset + normal.dot(new THREE.Vector3(x, y, z))};
}

/// 1, 2 or 5 times a power of ten, near `size`.
export function roundLength(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= size) ?? 10 * power;
}

export class Planes {
  group = new THREE.Group();
  #grids = [];

  constructor(run, bounds) {
    this.reach = kReach * bounds.radius;
    this.cell = roundLength(bounds.radius / 5);
    const up = new THREE.Vector3(...run.gravity).negate().normalize();
    const planes = run.bodies.filter((item) => item.form.kind === 'plane').map((body) => wallOf(body));
    planes.forEach((wall) => this.#add(wall, planes.filter((other) => other !== wall), bounds, up));
    this.edges = new THREE.LineBasicMaterial({transparent: true, opacity: 0.4});
    const edges = edgesOf(planes);
    if (edges.length) this.group.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(edges), this.edges));
  }

  /// What is behind other planes is not drawn, so that six of them look like a box.
  #add({normal, offset}, others, bounds, up) {
    const centre = bounds.centre.clone().addScaledVector(normal, offset - normal.dot(bounds.centre));
    const level = normal.dot(up) > 0.5;
    const grid = new THREE.Mesh(new THREE.PlaneGeometry(2 * this.reach, 2 * this.reach), planeMaterial({
      cell: {value: this.cell}, reach: {value: this.reach * (level ? 1 : 0.35)}, strength: {value: level ? 0.36 : 0.18},
      ink: {value: new THREE.Color()}, paper: {value: new THREE.Color()}, walls: {value: this.#cuts(normal, others, bounds)},
    }));
    grid.userData.level = level;
    grid.receiveShadow = true;
    grid.position.copy(centre);
    grid.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
    grid.renderOrder = -1;
    this.group.add(grid);
    this.#grids.push(grid);
  }

  /// Planes that cut this one, as normal and offset; one that cuts nothing stands for none.
  #cuts(normal, others, bounds) {
    const cuts = others.filter((other) => other.normal.dot(normal) < 0.99).slice(0, kMostCuts)
        .map((other) => new THREE.Vector4(...other.normal, other.offset - 1e-4 * bounds.radius));
    return cuts.length ? cuts : [new THREE.Vector4(0, 0, 0, -1)];
  }

  paint(theme) {
    this.edges.color.set(theme.room);
    for (const {material, userData} of this.#grids) {
      material.uniforms.ink.value.set(theme.grid);
      material.uniforms.paper.value.set(theme.ground);
      material.opacity = userData.level ? theme.shadow : 0.4 * theme.shadow;
    }
  }
}

/// The part of the line through `point` along `way` that is inside of all walls: [from, to], or null.
function inside(walls, point, way, left) {
  let from = -1e3, to = 1e3;
  for (const wall of walls) {
    if (left.includes(wall)) continue;
    const slope = wall.normal.dot(way), gap = wall.normal.dot(point) - wall.offset;
    if (Math.abs(slope) < 1e-9) {
      if (gap < -1e-6) return null;
    } else if (slope > 0) from = Math.max(from, -gap / slope);
    else to = Math.min(to, -gap / slope);
  }
  return to - from > 1e-6 ? [from, to] : null;
}

/// The edges of the space in front of all walls, as points of line segments; those of walls that do not meet are left out.
function edgesOf(walls) {
  const points = [];
  for (let one = 0; one < walls.length; ++one) {
    for (let two = one + 1; two < walls.length; ++two) {
      const a = walls[one], b = walls[two];
      const way = a.normal.clone().cross(b.normal);
      if (way.lengthSq() < 1e-9) continue;
      const square = way.lengthSq();
      const point = b.normal.clone().cross(way).multiplyScalar(a.offset)
          .add(way.clone().cross(a.normal).multiplyScalar(b.offset)).divideScalar(square);
      way.normalize();
      const part = inside(walls, point, way, [a, b]);
      if (part && part[1] - part[0] < 1e3) points.push(...part.map((along) => point.clone().addScaledVector(way, along)));
    }
  }
  return points;
}

export function roomEdges(room) {
  return edgesOf(room.walls.map((wall) => ({normal: new THREE.Vector3(...wall.normal).normalize(), offset: wall.offset})));
}
