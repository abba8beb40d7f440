// How loud a pressure is played at first: the loudest event at the ear at -6 dB of full scale.

const kHeadroom = 0.5;
const kLeast = 0.05;   // m: nearer to an event the ear is not taken to be

function distance(one, two) {
  return Math.max(kLeast, Math.hypot(one[0] - two[0], one[1] - two[1], one[2] - two[2]));
}

/// Full scale for each Pa. The peaks of events are those at the first listener, and fall with distance.
export function startVolume(run, ear) {
  const [listener] = run.listeners;
  let loudest = 0;
  for (const event of run.events) {
    const nearer = listener ? distance(event.position, listener.position) / distance(event.position, ear) : 1;
    loudest = Math.max(loudest, event.peak * Math.max(nearer, 0.05));
  }
  return loudest > 0 ? kHeadroom / loudest : 1;
}
