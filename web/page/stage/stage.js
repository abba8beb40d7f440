// The picture: a renderer, a camera that orbits and flies, light, and what one run shows.
import * as THREE from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {boundsOf, frame, upOf} from './bounds.js';
import {Bodies} from './bodies.js';
import {looksOf, rgbOfLch} from './colours.js';
import {Hand} from './hand.js';
import {Impacts} from './impacts.js';
import {Jello, Links, Listeners, Room} from './extras.js';
import {Planes} from './planes.js';
import {setStudio} from './studio.js';

const kFieldOfView = 36;       // degrees, along the shorter side of the picture
const kCoarsest = 0.42;        // least share of the pixels, along each side
const kMostPixels = 2;         // device pixels for a pixel of the page

function drawsInSoftware(context) {
  const names = context.getExtension('WEBGL_debug_renderer_info');
  return names !== null && /swiftshader|llvmpipe|software|basic render/i.test(context.getParameter(names.UNMASKED_RENDERER_WEBGL));
}

export class Stage {
  camera = new THREE.PerspectiveCamera(kFieldOfView, 1, 0.01, 100);
  #scene = new THREE.Scene();
  #ray = new THREE.Raycaster();
  #looked = 0;
  fineness = 1;
  touched = false;               // true once the reader has moved the camera
  ratio = null;                  // device pixels for a pixel of the picture, once a film has fixed it

  /// `smooth`: edges are smoothed even where there is no graphics hardware.
  constructor(canvas, labels, smooth = false) {
    this.smooth = smooth;
    this.canvas = canvas;
    this.labels = labels;
    this.renderer = this.#makeRenderer();
    this.sky = new THREE.HemisphereLight(0xffffff, 0x808080, 1);
    this.sun = new THREE.DirectionalLight(0xffffff, 1.6);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(this.soft && !smooth ? 1024 : 2048);
    this.sun.shadow.radius = 3;
    this.#scene.add(this.sky, this.sun, this.sun.target);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomToCursor = true;
  }

  /// Without graphics hardware every pixel counts, so edges are smoothed only where there is some.
  #makeRenderer() {
    const options = {powerPreference: 'high-performance', alpha: false};
    let context = this.canvas.getContext('webgl2', {...options, antialias: false});
    this.soft = drawsInSoftware(context);
    if (!this.soft || this.smooth) {
      // What a canvas was asked for first it keeps, so that another takes its place.
      const other = this.canvas.cloneNode();
      context.getExtension('WEBGL_lose_context')?.loseContext();
      this.canvas.replaceWith(other);
      this.canvas = other;
      context = other.getContext('webgl2', {...options, antialias: true});
    }
    const renderer = new THREE.WebGLRenderer({canvas: this.canvas, context, ...options});
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFShadowMap;
    renderer.toneMapping = THREE.NeutralToneMapping;
    return renderer;
  }

  /// Shows a run; the camera stays where it is unless it is the first.
  show(run) {
    const first = !this.run;
    this.run = run;
    if (this.content) this.#drop();
    this.bounds = this.boundsFor(run);
    this.up = upOf(run);
    this.looks = looksOf(run.bodies);
    this.bodies = new Bodies(run, this.looks);
    this.planes = new Planes(run, this.bounds);
    this.links = new Links(run, this.bounds);
    this.jello = run.jello ? new Jello(run.jello, this.looks.get(run.jello.body) ?? {lch: [0.68, 0.17, 20]}) : null;
    this.room = new Room(run.room);
    this.listeners = new Listeners(run, this.bounds, this.labels);
    this.impacts = new Impacts(run, this.bounds, this.looks);
    this.hand = new Hand(this.bounds);
    this.content = new THREE.Group();
    this.content.add(this.hand.group, this.planes.group, this.bodies.group, this.links.group, this.room.group, this.listeners.group, this.impacts.group);
    if (this.jello) this.content.add(this.jello.group);
    this.#scene.add(this.content);
    this.#light();
    if (this.theme) this.paint(this.theme);
    if (first) this.reset();
  }
  /// A run that goes on takes place where the run does that it began as.
  boundsFor(run) {
    return run.bounds ??= boundsOf(run);
  }
  /// Shows other bodies of the same run; those that stay keep their colours.
  showBodies() {
    const {run, bodies} = this;
    looksOf(run.bodies, this.looks);
    this.content.remove(bodies.group);
    this.bodies = new Bodies(run, this.looks);
    this.content.add(this.bodies.group);
    bodies.dispose();
  }
  #drop() {
    this.#scene.remove(this.content);
    this.content.traverse((item) => item.geometry?.dispose());
    this.bodies.dispose();
  }
  #light() {
    const {centre, radius} = this.bounds, aside = new THREE.Vector3(0.5, 0.2, 0.35);
    aside.addScaledVector(this.up, -aside.dot(this.up));
    this.sun.position.copy(centre).addScaledVector(this.up, 3 * radius).addScaledVector(aside, 2.2 * radius);
    this.sun.target.position.copy(centre);
    this.sky.position.copy(this.up);
    setStudio({up: this.up, key: this.sun.position.clone().sub(centre)});
    const reach = 1.9 * radius;
    Object.assign(this.sun.shadow.camera, {left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * radius, far: 9 * radius});
    this.sun.shadow.camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = 0.004 * radius;
    this.sun.shadow.bias = -0.0004;
  }

  paint(theme) {
    this.theme = theme;
    this.#scene.background = this.#backdrop(theme);
    this.sky.color.set(theme.sky);
    this.sky.groundColor.set(theme.bounce);
    this.sky.intensity = theme.ambient;
    setStudio({theme});
    this.sun.intensity = theme.sun;
    for (const part of [this.planes, this.links, this.room, this.listeners, this.impacts, this.hand]) part?.paint(theme);
  }
  #backdrop(theme) {
    const canvas = document.createElement('canvas');
    canvas.width = 2;
    canvas.height = 256;
    const pen = canvas.getContext('2d'), fill = pen.createLinearGradient(0, 0, 0, 256);
    theme.backdrop.forEach((colour, index) => fill.addColorStop(index / (theme.backdrop.length - 1), colour));
    pen.fillStyle = fill;
    pen.fillRect(0, 0, 2, 256);
    const texture = new THREE.CanvasTexture(canvas);
    texture.colorSpace = THREE.SRGBColorSpace;
    return texture;
  }

  /// The part of the picture that bars cover is left out when the view is centred.
  resize(width, height, insets) {
    this.width = width;
    this.height = height;
    this.renderer.setPixelRatio(this.#pixelRatio());
    this.renderer.setSize(width, height, false);
    const open = Math.max(60, height - insets.top - insets.bottom);
    // The field of view is that of the open part, whose shorter side counts.
    const half = Math.tan(kFieldOfView * Math.PI / 360) * Math.max(1, Math.min(2.2, open / width));
    this.camera.userData.aspect = width / open;
    this.camera.userData.open = open / height;
    this.camera.fov = 360 / Math.PI * Math.atan(half * height / open);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, (insets.bottom - insets.top) / 2, width, height);
    this.camera.updateProjectionMatrix();
  }

  reset() {
    const whole = this.camera.fov;
    this.camera.fov = 360 / Math.PI * Math.atan(Math.tan(whole * Math.PI / 360) * (this.camera.userData.open ?? 1));
    const target = frame(this.camera, this.bounds, this.up);
    this.camera.fov = whole;
    this.camera.updateProjectionMatrix();
    this.controls.dispose();
    const {enableDamping, dampingFactor} = this.controls;
    this.controls = new OrbitControls(this.camera, this.canvas);   // takes `up` when it is made
    Object.assign(this.controls, {enableDamping, dampingFactor, zoomToCursor: true, minDistance: 0.02 * this.bounds.radius,
                                  maxDistance: 30 * this.bounds.radius});
    this.controls.target.copy(target);
    this.controls.addEventListener('start', () => this.touched = true);
    this.controls.update();
    this.touched = false;
  }

  /// Moves the camera and what it looks at; right, up and ahead in radii of the scene.
  fly(right, up, ahead) {
    const step = new THREE.Vector3(right, 0, -ahead).applyQuaternion(this.camera.quaternion).addScaledVector(this.up, up);
    step.multiplyScalar(this.bounds.radius);
    this.touched = true;
    this.camera.position.add(step);
    this.controls.target.add(step);
  }
  /// Turns about what is looked at; radians.
  orbit(aside, above) {
    this.touched = true;
    const from = this.camera.position.clone().sub(this.controls.target).applyAxisAngle(this.up, aside);
    const axis = this.up.clone().cross(from).normalize();
    const tilted = from.clone().applyAxisAngle(axis, -above);
    const angle = tilted.angleTo(this.up);
    this.camera.position.copy(this.controls.target).add(angle > 0.05 && angle < Math.PI - 0.05 ? tilted : from);
  }

  /// True if the camera has moved by itself, as it does for a while after a drag.
  settle() {
    return this.controls.update();
  }
  /// Fewer pixels, for a machine that is too slow for all of them.
  coarsen() {
    this.#setFineness(Math.max(kCoarsest, 0.75 * this.fineness));
  }
  /// All pixels again, for a picture that stands.
  refine() {
    this.#setFineness(1);
  }
  #setFineness(fineness) {
    if (fineness === this.fineness) return;
    this.fineness = fineness;
    this.renderer.setPixelRatio(this.#pixelRatio());
    this.renderer.setSize(this.width, this.height, false);
  }
  #pixelRatio() {
    return this.ratio ?? this.fineness * Math.min(kMostPixels, devicePixelRatio);
  }

  /// `looks`: what stands before the rest is looked for now, and not only now and then.
  draw(time, speed, ear, looks = false) {
    this.bodies.update(time);
    this.links.update(time);
    this.jello?.update(time);
    this.impacts.update(time, speed, this.height * this.#pixelRatio());
    this.listeners.update(time, this, ear);
    if (looks || this.#looked++ % 12 === 0) {
      this.#ray.set(this.camera.position, this.bounds.centre.clone().sub(this.camera.position).normalize());
      this.#ray.far = Math.max(0, this.camera.position.distanceTo(this.bounds.centre) - 0.2 * this.bounds.radius);
      this.bodies.lookThrough(this.#ray);
    }
    this.renderer.render(this.#scene, this.camera);
  }

  /// Gives the picture a size in pixels and the first view, and shows one listener (-1: none): for a film.
  hold(width, height, listener) {
    this.ratio = 1;
    this.listeners.only = listener;
    this.resize(width, height, {top: 0, bottom: 0});
    this.reset();
  }
  /// Puts the camera somewhere: x y z, w x y z, and its field of view in degrees along the shorter side.
  place([x, y, z, qw, qx, qy, qz], fieldOfView = kFieldOfView) {
    const {camera, bounds} = this;
    camera.position.set(x, y, z);
    camera.quaternion.set(qx, qy, qz, qw);
    const longer = Math.max(1, this.height / this.width);
    camera.fov = 360 / Math.PI * Math.atan(Math.tan(fieldOfView * Math.PI / 360) * longer);
    const distance = camera.position.distanceTo(bounds.centre);
    camera.near = 0.01 * Math.max(0.1 * bounds.radius, distance - bounds.radius);
    camera.far = 60 * bounds.radius + 2 * distance;
    camera.updateProjectionMatrix();
  }
  /// Degrees along the shorter side of the picture.
  get fieldOfView() {
    return kFieldOfView;
  }

  /// The body at a place of the picture, or null.
  pick(x, y) {
    return this.pickPoint(x, y)?.body ?? null;
  }
  /// The body at a place of the picture, and the point of it that is seen; or null.
  pickPoint(x, y) {
    this.#aim(x, y);
    const hit = this.bodies.pick(this.#ray);
    const [soft] = this.jello ? this.#ray.intersectObject(this.jello.mesh, false) : [];
    if (soft && (!hit || soft.distance < hit.distance)) return {body: this.run.jello.body, point: soft.point};
    return hit;
  }
  /// The ray from the eye through a place of the picture.
  ray(x, y) {
    this.#aim(x, y);
    return this.#ray.ray.clone();
  }
  #aim(x, y) {
    this.camera.updateMatrixWorld();
    this.#ray.far = Infinity;
    this.#ray.setFromCamera(new THREE.Vector2(2 * x / this.width - 1, 1 - 2 * y / this.height), this.camera);
  }

  /// A body's colour, 0 to 255 each, before light falls on it.
  colourOf(body) {
    return rgbOfLch(this.looks.get(body).lch);
  }

  /// A place `height` m above another, as the picture is held.
  above(place, height) {
    return new THREE.Vector3(...place).addScaledVector(this.up, height).toArray();
  }

  /// Pixels of the page, and the depth, which is above 1 behind the camera.
  project([x, y, z]) {
    this.camera.updateMatrixWorld();
    const behind = new THREE.Vector3(x, y, z).applyMatrix4(this.camera.matrixWorldInverse).z > 0;
    const at = new THREE.Vector3(x, y, z).project(this.camera);
    return [(at.x + 1) / 2 * this.width, (1 - at.y) / 2 * this.height, behind ? 2 : at.z];
  }

  /// The camera's pose as an ear: x y z, w x y z.
  cameraPose() {
    const {position, quaternion} = this.camera;
    return [position.x, position.y, position.z, quaternion.w, quaternion.x, quaternion.y, quaternion.z];
  }
}
