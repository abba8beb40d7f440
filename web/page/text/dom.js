// Small helpers for elements, icons and numbers.

export const byId = (id) => document.getElementById(id);

/// An element with attributes and children; `on…` are listeners.
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

const kIcons = {
  play: '<path d="M7 4.5v15l12.5-7.5z" fill="currentColor" stroke="none"/>',
  pause: '<path d="M7 5h3.6v14H7zM13.4 5H17v14h-3.6z" fill="currentColor" stroke="none"/>',
  previous: '<path d="M18 6l-8 6 8 6z" fill="currentColor"/><path d="M6.5 6v12"/>',
  next: '<path d="M6 6l8 6-8 6z" fill="currentColor"/><path d="M17.5 6v12"/>',
  loop: '<path d="M4 12V9.5A3.5 3.5 0 0 1 7.5 6H19"/><path d="M16 3l3 3-3 3"/><path d="M20 12v2.5a3.5 3.5 0 0 1-3.5 3.5H5"/><path d="M8 21l-3-3 3-3"/>',
  sound: '<path d="M4 9.5v5h3.5L12 18.5v-13L7.5 9.5z" fill="currentColor"/><path d="M15.5 9a4 4 0 0 1 0 6"/><path d="M18 6.5a7.5 7.5 0 0 1 0 11"/>',
  muted: '<path d="M4 9.5v5h3.5L12 18.5v-13L7.5 9.5z" fill="currentColor"/><path d="M15.5 9.5l5 5m0-5l-5 5"/>',
  mixer: '<path d="M6 4v9m0 4v3M12 4v3m0 4v9M18 4v10m0 4v2"/><circle cx="6" cy="15" r="2"/><circle cx="12" cy="9" r="2"/><circle cx="18" cy="16" r="2"/>',
  frame: '<path d="M4 9V4.5h4.5M15.5 4.5H20V9M20 15v4.5h-4.5M8.5 19.5H4V15"/><circle cx="12" cy="12" r="2.5"/>',
  film: '<rect x="3.5" y="6" width="11.5" height="12" rx="2.5"/><path d="M15 10.5l5.5-3v9l-5.5-3z" fill="currentColor"/>',
  keys: '<circle cx="12" cy="12" r="8.5"/><path d="M9.5 9.5a2.5 2.5 0 1 1 3.700 2.200c-.8.5-1.200 1-1.200 1.900"/><path d="M12 16.700v.1" stroke-width="2.200"/>',
  about: '<circle cx="12" cy="12" r="8.5"/><path d="M12 11v5.5"/><path d="M12 7.600v.1" stroke-width="2.200"/>',
  close: '<path d="M6 6l12 12M18 6L6 18"/>',
  hand: '<path d="M8 12.5V6.200a1.500 1.500 0 0 1 3 0V11m0-.5V4.700a1.500 1.500 0 0 1 3 0V11m0-.5V6.700a1.500 1.500 0 0 1 3 0v7.300a6 6 0 0 1-6 6c-2.500 0-4-1-5.200-3L4 13.200a1.500 1.500 0 0 1 2.500-1.600L8 13.500"/>',
  throw: '<circle cx="17" cy="7" r="3.500" fill="currentColor" stroke="none"/><path d="M4 20l7-7M4 14l4.500-4.500M10 20l4.500-4.500"/>',
  drop: '<circle cx="12" cy="6.500" r="3.500" fill="currentColor" stroke="none"/><path d="M12 12.500v5m-2.500-2l2.500 2.500 2.500-2.500M5 21h14"/>',
  ear: '<path d="M7 10a5 5 0 0 1 10 0c0 3.5-3.5 4-3.5 7a2.5 2.5 0 0 1-4.800 1"/><path d="M9.800 10a2.200 2.200 0 0 1 4.400 0c0 1.300-1.200 1.700-1.200 2.800"/>',
};
export function icon(name) {
  const holder = document.createElement('span');
  holder.className = 'icon';
  holder.setAttribute('aria-hidden', 'true');
  holder.innerHTML = `<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="1.7" stroke-linecap="round" stroke-linejoin="round">${kIcons[name]}</svg>`;
  return holder;
}
/// Puts an icon before what an element holds, in place of the one it had.
export function setIcon(element, name) {
  if (element.dataset.shown === name) return;
  element.dataset.shown = name;
  element.querySelector(':scope > .icon')?.remove();
  element.prepend(icon(name));
}

const kThin = '\u202f';
const kPrefixes = [[1, ''], [1e-3, 'm'], [1e-6, 'µ'], [1e-9, 'n']];

/// Three digits and a unit: 12.3 mN s.
export function quantity(value, unit, digits = 3) {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return `0${kThin}${unit}`;
  const size = Math.abs(value);
  if (size >= 1000 && (unit === 'kg' || unit === 'm/s')) return `${Math.round(value)}${kThin}${unit}`;
  if (unit === 'kg' && size < 1) return quantity(value * 1000, 'g', digits);
  if (size >= 1000) return `${Number((value / 1000).toPrecision(digits))}${kThin}k${unit}`;
  const [scale, prefix] = kPrefixes.find(([step]) => size >= step * 0.9995) ?? kPrefixes[3];
  return `${Number((value / scale).toPrecision(digits))}${kThin}${prefix}${unit}`;
}
/// 1.234 567 s
export function microseconds(time) {
  const [whole, part] = time.toFixed(6).split('.');
  return `${whole}.${part.slice(0, 3)}${kThin}${part.slice(3)}${kThin}s`;
}
export function decibelWords(level) {
  return Number.isFinite(level) ? `${level.toFixed(1)}${kThin}dB` : 'not heard';
}
/// 1, 0.5 as 1/2, 0.004 as 1/250
export function speedWords(speed) {
  if (speed > 0.995) return '1';
  const parts = 1 / speed;
  return `1/${parts >= 100 ? Math.round(parts / 10) * 10 : Number(parts.toPrecision(2))}`;
}
