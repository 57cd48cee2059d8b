// Vectors and matrices. Positions are doubles until the camera is taken off them: a scene far from
// the origin is drawn as exactly as one at it.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const plus = (a, b, scale = 1) => a.map((value, k) => value + scale * b[k]);
export const times = (a, scale) => a.map((value) => scale * value);
export const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => a.map((value) => value / (Math.hypot(...a) || 1));

// Turns v by the unit quaternion x, y, z, w.
export function turn([x, y, z, w], v) {
  const t = cross([x, y, z], v).map((value) => 2 * value);
  return plus(plus(v, t, w), cross([x, y, z], t));
}

// Returns the quaternion after turning further, about a unit axis by an angle.
export function about(axis, angle, [x, y, z, w]) {
  const [a, b, c] = times(axis, Math.sin(angle / 2)), d = Math.cos(angle / 2);
  return unit([d * x + a * w + b * z - c * y, d * y + b * w + c * x - a * z,
    d * z + c * w + a * y - b * x, d * w - a * x - b * y - c * z]);
}

// Returns the quaternion that turns z to the unit vector n.
export function turnZTo(n) {
  if (n[2] < -0.999999) return [1, 0, 0, 0];
  const q = [-n[1], n[0], 0, 1 + n[2]];
  return q.map((value) => value / Math.hypot(...q));
}

// Column by column: what is seen from the origin along -back, in clip space.
export function projection(right, up, back, focal, aspect, near, far) {
  const depth = (near + far) / (near - far), shift = (2 * near * far) / (near - far);
  const columns = [];
  for (let k = 0; k < 3; k++) {
    columns.push(focal / aspect * right[k], focal * up[k], depth * back[k], -back[k]);
  }
  return new Float32Array([...columns, 0, 0, shift, 0]);
}
