// Contacts that last: who, from when to when, and whether they slide.

export const kContactWidth = 6;
const kSame = 2e-3;   // s between two steps of one contact

export function contactOf(table, at) {
  return {body: table[at], other: table[at + 1], begin: table[at + 2], end: table[at + 3],
          slides: table[at + 4] === 1, force: table[at + 5]};
}

/// Contacts that are told step by step, and may be taken back.
export class ContactList {
  contacts = [];
  #last = new Map();   // by bodies: the latest

  add(table) {
    for (let at = 0; at + kContactWidth <= table.length; at += kContactWidth) this.#step(contactOf(table, at));
  }
  #step(step) {
    const key = `${step.body} ${step.other}`, last = this.#last.get(key);
    if (last && last.slides === step.slides && step.begin - last.end < kSame) {
      last.end = Math.max(last.end, step.end);
      last.force = Math.max(last.force, step.force);
      return;
    }
    this.#last.set(key, step);
    this.contacts.push(step);
  }
  /// Takes back all after a time (s).
  keep(time) {
    const kept = this.contacts.filter((contact) => contact.begin < time);
    this.contacts.length = 0;   // in place, and one by one: there may be more than a call takes
    for (const contact of kept) this.contacts.push(contact);
    this.#last.clear();
    for (const contact of kept) {
      contact.end = Math.min(contact.end, time);
      this.#last.set(`${contact.body} ${contact.other}`, contact);
    }
  }
}
