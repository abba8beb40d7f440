// Bodies of one run: those of like form and look are instances of one mesh.
import * as THREE from 'three';
import {bandTexture, geometryOf, seamTexture, sharedForm} from './forms.js';
import {rgbOfLch} from './colours.js';
import {studioMaterial} from './studio.js';

const kMany = 40;   // bodies, of which each is drawn with fewer triangles
// One material for all shadows, as each is compiled by itself.
const shadowOnly = new THREE.MeshDepthMaterial({side: THREE.DoubleSide});
const textures = {};
function markings(kind) {
  if (kind === 'sphere') return textures.seam ??= seamTexture();
  if (kind === 'cylinder' || kind === 'capsule') return textures.band ??= bandTexture();
  return null;
}

function surfaceOf(look, form) {
  const clear = look.opacity < 1;
  return studioMaterial({
    clear, color: 0xffffff, roughness: look.rough, metalness: look.metal, map: markings(form.kind),
    transparent: clear, opacity: look.opacity, side: form.kind === 'mesh' ? THREE.DoubleSide : THREE.FrontSide,
  });
}

export class Bodies {
  group = new THREE.Group();
  #groups = [];
  #places = new Map();   // body to {mesh, index, scale}
  #dimmed = new Set();
  #pose = new Array(7);
  #matrix = new THREE.Matrix4();
  #place = new THREE.Vector3();
  #turn = new THREE.Quaternion();

  constructor(run, looks) {
    this.run = run;
    this.looks = looks;
    const sorted = new Map();
    for (const body of run.bodies) {
      const shared = sharedForm(body.form, body.radius);
      if (!shared || body.id === run.jello?.body) continue;
      const look = looks.get(body.id);
      // A body that stays may come between the eye and the others, and is then dimmed by itself.
      const key = `${shared.key} ${look.rough} ${look.metal} ${look.opacity} ${body.moves ? '' : body.id}`;
      if (!sorted.has(key)) sorted.set(key, []);
      sorted.get(key).push({body, scale: new THREE.Vector3(...shared.scale)});
    }
    for (const members of sorted.values()) this.#add(members);
    this.update(0);
    // Those that stay are placed once.
    this.moving = run.bodies.filter((body) => this.#places.has(body.id) && run.tracks.moves(body.id)).map((body) => body.id);
  }

  #add(members) {
    const [{body}] = members;
    const material = surfaceOf(this.looks.get(body.id), body.form);
    const mesh = new THREE.InstancedMesh(geometryOf(body.form, this.run.meshes, this.run.bodies.length < kMany), material, members.length);
    mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    mesh.frustumCulled = false;
    mesh.castShadow = true;
    mesh.customDepthMaterial = shadowOnly;
    mesh.receiveShadow = true;
    mesh.userData.bodies = members.map((member) => member.body.id);
    mesh.userData.stays = !body.moves;
    const colour = new THREE.Color();
    members.forEach((member, index) => {
      const [red, green, blue] = rgbOfLch(this.looks.get(member.body.id).lch);
      mesh.setColorAt(index, colour.setRGB(red / 255, green / 255, blue / 255, THREE.SRGBColorSpace));
      this.#places.set(member.body.id, {mesh, index, scale: member.scale, born: member.body.born ?? -1});
    });
    this.#groups.push(mesh);
    this.group.add(mesh);
  }

  update(time) {
    for (const id of this.moving ?? this.#places.keys()) this.#move(id, time);
    for (const mesh of this.#groups) {
      if (this.moving && mesh.userData.stays) continue;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.boundingSphere = null;
    }
  }
  #move(id, time) {
    const place = this.#places.get(id);
    // A body that was added is not there before.
    if (time < place.born) return place.mesh.setMatrixAt(place.index, this.#matrix.makeScale(0, 0, 0));
    const [x, y, z, qw, qx, qy, qz] = this.run.tracks.pose(id, time, this.#pose);
    this.#matrix.compose(this.#place.set(x, y, z), this.#turn.set(qx, qy, qz, qw), place.scale);
    return place.mesh.setMatrixAt(place.index, this.#matrix);
  }

  /// The body under a ray, and how far; bodies that are dimmed are looked through.
  pick(raycaster) {
    const [hit] = raycaster.intersectObjects(this.#groups.filter((mesh) => !this.#dimmed.has(mesh)), false);
    return hit ? {body: hit.object.userData.bodies[hit.instanceId], distance: hit.distance, point: hit.point} : null;
  }

  /// Dims what stays and stands between the eye and what moves.
  lookThrough(raycaster) {
    const stays = this.#groups.filter((mesh) => mesh.userData.stays);
    const hidden = new Set(raycaster.intersectObjects(stays, false).map((hit) => hit.object));
    for (const mesh of stays) {
      if (hidden.has(mesh) === this.#dimmed.has(mesh)) continue;
      const look = this.looks.get(mesh.userData.bodies[0]);
      const dim = hidden.has(mesh);
      mesh.material.opacity = dim ? 0.16 : look.opacity;
      mesh.material.transparent = dim || look.opacity < 1;
      mesh.material.depthWrite = !dim;
      mesh.castShadow = !dim;
      mesh.material.needsUpdate = true;
      if (dim) this.#dimmed.add(mesh); else this.#dimmed.delete(mesh);
    }
  }

  dispose() {
    for (const mesh of this.#groups) {
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
  }
}
