// Colours of bodies: the hue of the material, apart enough where many bodies share one.

/// OKLCH, in which steps of hue look alike in lightness: [L, chroma, hue in degrees], surface, and how far hues may
/// spread where several bodies are of one material.
const kMaterials = [
  [/rubber|tyre/, {lch: [0.34, 0.02, 280], rough: 0.95, spread: 60, chroma: 0.05}],
  [/cushion|cloth|felt|baize|table/, {lch: [0.48, 0.09, 160], rough: 1, spread: 20}],
  [/brass|gold|bronze/, {lch: [0.76, 0.11, 85], rough: 0.3, metal: 0.75, spread: 20}],
  [/copper/, {lch: [0.66, 0.12, 48], rough: 0.3, metal: 0.75, spread: 20}],
  [/steel|iron|titan|nickel|zinc|tin\b|lead|tungsten|magnesium|silver|platinum|alumin|metal|coin|shot/,
   {lch: [0.74, 0.035, 245], rough: 0.28, metal: 0.75, spread: 360, chroma: 0.03}],
  [/glass|silica|ice|crystal/, {lch: [0.77, 0.1, 185], rough: 0.06, opacity: 0.62, spread: 360, chroma: 0.11}],
  [/wood|oak|spruce|maple|pine|balsa|cork|board|pen\b/, {lch: [0.6, 0.075, 62], rough: 0.75, spread: 40}],
  [/brick|clay|terra/, {lch: [0.55, 0.11, 38], rough: 1, spread: 20}],
  [/concrete|stone|granite|marble|rock|plaster/, {lch: [0.68, 0.012, 85], rough: 0.95, spread: 40, chroma: 0.03}],
  [/ceramic|alumina|porcelain|china|plate/, {lch: [0.9, 0.03, 75], rough: 0.25, spread: 360, chroma: 0.06}],
  [/phenolic|billiard|pool|resin/, {lch: [0.66, 0.15, 30], rough: 0.18, spread: 360, chroma: 0.15}],
  [/jell/, {lch: [0.68, 0.17, 20], rough: 0.2, opacity: 0.6, spread: 360}],
  [/plastic|acryl|abs|nylon|poly|hdpe|ptfe/, {lch: [0.68, 0.15, 40], rough: 0.4, spread: 360, chroma: 0.14}],
];
const kOther = {lch: [0.68, 0.1, 300], rough: 0.5, spread: 360, chroma: 0.1};
const kGoldenAngle = 137.508;

function materialOf(body) {
  const words = [body.material ?? '', body.name ?? ''];
  for (const word of words) {
    const found = kMaterials.find(([pattern]) => pattern.test(word.toLowerCase()));
    if (found) return found[1];
  }
  return kOther;
}

function srgb(linear) {
  const value = linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
  return Math.round(255 * Math.min(1, Math.max(0, value)));
}
/// OKLab's matrices: Ottosson, "A perceptual color space for image processing", 2020.
export function rgbOfLch([lightness, chroma, hue]) {
  const a = chroma * Math.cos(hue * Math.PI / 180), b = chroma * Math.sin(hue * Math.PI / 180);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3;
  return [srgb(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          srgb(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          srgb(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)];
}
export function cssOf(lch) {
  return `rgb(${rgbOfLch(lch).join(' ')})`;
}

/// The hue of the nth of several bodies: golden angles where all hues are free, else evenly about the material's.
function varied(base, order, count) {
  const [lightness, chroma, hue] = base.lch;
  if (count < 2) return base.lch;
  if (base.spread === 360) {
    return [lightness + 0.05 * ((order % 3) - 1), base.chroma ?? chroma, (hue + order * kGoldenAngle) % 360];
  }
  const place = (order * 0.618034) % 1 - 0.5;
  return [lightness + 0.16 * ((order * 0.381966) % 1 - 0.5), base.chroma ?? chroma, hue + base.spread * place];
}

/// A body's look: {lch, rough, metal, opacity}. Bodies that never move are calmer than those that do. Those that are
/// in `looks` already stay as they are; of what comes later, there may be more.
export function looksOf(bodies, looks = new Map()) {
  const groups = new Map(), more = looks.size > 0;
  const keyOf = (body) => `${kMaterials.indexOf(kMaterials.find(([, base]) => base === materialOf(body)))} ${body.moves}`;
  for (const body of bodies) groups.set(keyOf(body), (groups.get(keyOf(body)) ?? 0) + 1);
  const orders = new Map(), ids = new Set(bodies.map((body) => body.id));
  for (const id of looks.keys()) if (!ids.has(id)) looks.delete(id);
  for (const body of bodies) {
    const key = keyOf(body), base = materialOf(body), order = orders.get(key) ?? 0;
    orders.set(key, order + 1);
    if (looks.get(body.id)?.name === body.name) continue;
    const lch = body.moves ? varied(base, order, more ? Math.max(2, groups.get(key)) : groups.get(key)) : base.lch;
    looks.set(body.id, {name: body.name, lch, rough: base.rough, metal: base.metal ?? 0, opacity: base.opacity ?? 1});
  }
  return looks;
}

/// The colour of a body's marks on the time line, which has to be told from the paper.
export function markColour(lch, dark) {
  return cssOf([dark ? Math.max(0.72, Math.min(0.84, lch[0])) : Math.min(0.56, lch[0]), Math.max(0.07, lch[1]), lch[2]]);
}
