// How large and how fast a body may be that is thrown.

export const kLeastSize = 0.002, kMostSize = 0.5;   // m across
export const kLeastSpeed = 0.1, kMostSpeed = 30;    // m/s
