// Magnitudes of the spectrum of a stretch of samples, under a window of Hann.

export class Fourier {
  constructor(size) {
    this.size = size;
    this.real = new Float64Array(size);
    this.imaginary = new Float64Array(size);
    this.shape = Float64Array.from({length: size}, (none, at) => 0.5 - 0.5 * Math.cos(2 * Math.PI * at / size));
    this.cosine = Float64Array.from({length: size / 2}, (none, at) => Math.cos(2 * Math.PI * at / size));
    this.sine = Float64Array.from({length: size / 2}, (none, at) => -Math.sin(2 * Math.PI * at / size));
    const bits = Math.log2(size);
    this.order = Uint32Array.from({length: size}, (none, at) => {
      let turned = 0;
      for (let bit = 0; bit < bits; ++bit) if (at & (1 << bit)) turned |= 1 << (bits - 1 - bit);
      return turned;
    });
  }

  /// Writes amplitudes of sines, in the samples' unit, to `out` (size / 2).
  amplitudes(samples, out) {
    const {size, real, imaginary} = this;
    for (let at = 0; at < size; ++at) {
      real[this.order[at]] = samples[at] * this.shape[at];
      imaginary[at] = 0;
    }
    for (let half = 1; half < size; half *= 2) this.#pass(half);
    for (let bin = 0; bin < size / 2; ++bin) out[bin] = 4 / size * Math.hypot(real[bin], imaginary[bin]);
    return out;
  }
  #pass(half) {
    const {size, real, imaginary} = this, step = size / (2 * half);
    for (let start = 0; start < size; start += 2 * half) {
      for (let at = 0; at < half; ++at) {
        const one = start + at, two = one + half;
        const cosine = this.cosine[at * step], sine = this.sine[at * step];
        const turnedReal = real[two] * cosine - imaginary[two] * sine;
        const turnedImaginary = real[two] * sine + imaginary[two] * cosine;
        real[two] = real[one] - turnedReal;
        imaginary[two] = imaginary[one] - turnedImaginary;
        real[one] += turnedReal;
        imaginary[one] += turnedImaginary;
      }
    }
  }
}
