// Plays a motion: bodies at moments, and between them.

export class Player {
  // onChange is called when another moment is shown, onEnd when the end is reached.
  constructor(onChange, onEnd) {
    this.onChange = onChange;
    this.onEnd = onEnd;
    this.clear();
  }

  clear() {
    cancelAnimationFrame(this.frame);
    this.motion = null;
    this.isPlaying = false;
    this.time = 0;
  }

  // Takes a motion {geometries, times, positions, rotations}, and shows its beginning.
  load(motion) {
    this.clear();
    this.motion = motion;
  }

  go(time) {
    this.time = Math.max(0, Math.min(this.motion.times.at(-1), time));
    this.onChange();
  }

  // Plays it, so many seconds in one.
  play(rate = 1) {
    cancelAnimationFrame(this.frame);
    if (this.time >= this.motion.times.at(-1)) this.time = 0;
    this.isPlaying = true;
    let before = performance.now();
    const step = (now) => {
      this.go(this.time + rate * Math.max(0, now - before) / 1000);
      before = now;
      this.isPlaying = this.time < this.motion.times.at(-1);
      if (this.isPlaying) this.frame = requestAnimationFrame(step);
      else this.onEnd();
    };
    this.frame = requestAnimationFrame(step);
  }

  // Returns where each geometry is now: position and rotation by its number.
  poses() {
    const { geometries, times, positions, rotations } = this.motion;
    const next = Math.max(1, times.findIndex((each) => each >= this.time));
    const span = times[next] - times[next - 1] || 1, part = (this.time - times[next - 1]) / span;
    const count = geometries.length, result = new Map();
    geometries.forEach((geometry, k) => {
      const at = (numbers, width, moment) => {
        const place = width * (moment * count + k);
        return numbers.subarray(place, place + width);
      };
      const mix = (numbers, width) => {
        const one = at(numbers, width, next - 1), two = at(numbers, width, next);
        const sign = width === 4 && one.reduce((sum, v, j) => sum + v * two[j], 0) < 0 ? -1 : 1;
        return [...one].map((value, j) => (1 - part) * value + sign * part * two[j]);
      };
      const rotation = mix(rotations, 4), length = Math.hypot(...rotation);
      result.set(geometry, { position: mix(positions, 3),
        rotation: rotation.map((value) => value / length) });
    });
    return result;
  }
}
