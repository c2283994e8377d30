// The amplitude spectrum of evenly spaced samples.

/** In place; the length is a power of two. */
function transform(real, imaginary) {
  const n = real.length;
  for (let i = 1, j = 0; i < n; ++i) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [real[i], real[j]] = [real[j], real[i]];
      [imaginary[i], imaginary[j]] = [imaginary[j], imaginary[i]];
    }
  }
  for (let size = 2; size <= n; size *= 2) {
    const angle = (-2 * Math.PI) / size;
    for (let start = 0; start < n; start += size) {
      for (let k = 0; k < size / 2; ++k) {
        const c = Math.cos(angle * k), s = Math.sin(angle * k);
        const a = start + k, b = a + size / 2;
        const x = real[b] * c - imaginary[b] * s, y = real[b] * s + imaginary[b] * c;
        real[b] = real[a] - x;
        imaginary[b] = imaginary[a] - y;
        real[a] += x;
        imaginary[a] += y;
      }
    }
  }
}

/**
 * {frequency: [Hz], amplitude: [], peak: {frequency, amplitude}} of the last power of two of `samples`, in a Hann window,
 * without their mean; a sine of amplitude 1 shows as 1. The peak is found between the lines by a parabola. Null: too few.
 */
export function spectrum(samples, rate) {
  const n = 2 ** Math.floor(Math.log2(samples.length));
  if (n < 64) return null;
  const used = samples.slice(samples.length - n);
  const mean = used.reduce((sum, value) => sum + value, 0) / n;
  const real = new Float64Array(n), imaginary = new Float64Array(n);
  for (let i = 0; i < n; ++i) real[i] = (used[i] - mean) * (1 - Math.cos((2 * Math.PI * i) / n));
  transform(real, imaginary);
  const frequency = [], amplitude = [];
  for (let i = 1; i < n / 2; ++i) {
    frequency.push((i * rate) / n);
    amplitude.push((2 * Math.hypot(real[i], imaginary[i])) / n);
  }
  let at = 2;
  for (let i = 2; i < amplitude.length - 1; ++i) if (amplitude[i] > amplitude[at]) at = i;
  const [a, b, c] = [amplitude[at - 1], amplitude[at], amplitude[at + 1]];
  const bend = a - 2 * b + c;
  const shift = bend < 0 ? (a - c) / (2 * bend) : 0;
  return { frequency, amplitude, peak: { frequency: frequency[at] + (shift * rate) / n, amplitude: b } };
}
