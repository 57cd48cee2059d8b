// Programs of the graphics processor.

const HEAD = "#version 300 es\nprecision highp float;\n";

// Many of one form. Places are relative to the eye.
export const BODY = {
  vertex: `${HEAD}
    uniform mat4 u_matrix;
    layout(location = 0) in vec3 a_place;
    layout(location = 1) in float a_shift;
    layout(location = 2) in vec3 a_normal;
    layout(location = 3) in vec3 a_position;
    layout(location = 4) in vec4 a_rotation;
    layout(location = 5) in vec4 a_stretch;
    layout(location = 6) in vec4 a_color;
    layout(location = 7) in vec4 a_paint;
    layout(location = 8) in vec2 a_cover;
    out vec3 v_normal;
    out vec3 v_place;
    out vec4 v_color;
    flat out vec4 v_paint;
    out vec2 v_cover;
    vec3 turn(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
    void main() {
      vec3 place = a_place * a_stretch.xyz + vec3(0.0, 0.0, a_shift * a_stretch.w);
      v_normal = turn(a_rotation, a_normal / max(a_stretch.xyz, vec3(1e-12)));
      v_place = a_position + turn(a_rotation, place);
      v_color = a_color;
      v_paint = a_paint;
      v_cover = a_cover;
      gl_Position = u_matrix * vec4(v_place, 1.0);
    }`,
  // Paint shows through the body's own color, which is black for what is not chosen; what is plain
  // has its own color alone.
  // Light from above and from the eye; both sides of a triangle are lit. Rows of textures are counted
  // from above.
  fragment: `${HEAD}
    uniform bool u_covered, u_plain;
    uniform sampler2D u_texture;
    in vec3 v_normal;
    in vec3 v_place;
    in vec4 v_color;
    flat in vec4 v_paint;
    in vec2 v_cover;
    out vec4 color;
    void main() {
      vec4 paint = vec4(v_paint.rgb, 1.0);
      if (u_covered) paint *= texture(u_texture, vec2(v_cover.x, 1.0 - v_cover.y));
      vec3 own = mix(v_color.rgb, paint.rgb + (1.0 - paint.rgb) * v_color.rgb, v_paint.a);
      if (u_plain) {
        own = v_color.rgb;
        paint.a = 1.0;
      }
      vec3 view = -normalize(v_place);
      vec3 n = normalize(v_normal);
      n = dot(n, view) < 0.0 ? -n : n;
      float light = 0.42 + 0.18 * n.z + 0.4 * max(dot(n, view), 0.0);
      color = vec4(own * light, v_color.a * paint.a);
    }`,
};

// Of what is in front, its number in the colour.
export const PICK = {
  vertex: BODY.vertex,
  fragment: `${HEAD}
    in vec4 v_color;
    out vec4 color;
    void main() { color = v_color; }`,
};

// A plane without end: a square around the point of it that is nearest to the eye, so large that
// its edge has faded. Lines are counted from the origin of the half space, and a picture is there
// instead of them where it has one.
export const PLANE = {
  vertex: `${HEAD}
    uniform mat4 u_matrix;
    uniform vec3 u_foot, u_along, u_across;
    uniform float u_extent;
    layout(location = 0) in vec2 a_corner;
    void main() {
      vec2 away = a_corner * u_extent;
      gl_Position = u_matrix * vec4(u_foot + u_along * away.x + u_across * away.y, 1.0);
    }`,
  // Where the ray of a pixel meets the plane: between corners that are so far apart, an interpolated
  // place would be off by decimetres.
  fragment: `${HEAD}
    uniform vec4 u_color;
    uniform float u_extent, u_step, u_height;
    uniform mat3 u_rays;
    uniform vec2 u_pixels, u_start;
    uniform bool u_covered;
    uniform sampler2D u_texture;
    uniform vec2 u_repeats, u_begin;
    out vec4 color;
    float lines(vec2 at, float step) {
      vec2 place = at / step;
      vec2 width = fwidth(place);
      vec2 away = abs(fract(place - 0.5) - 0.5) / max(width, vec2(1e-6));
      float line = 1.0 - min(min(away.x, away.y), 1.0);
      return line * (1.0 - smoothstep(0.2, 0.6, max(width.x, width.y)));
    }
    void main() {
      vec3 ray = u_rays * vec3(2.0 * gl_FragCoord.xy / u_pixels - 1.0, 1.0);
      vec2 away = -u_height / ray.z * ray.xy;
      float line = max(0.5 * lines(u_start + away, u_step), lines(u_start + away, 10.0 * u_step));
      float fade = 1.0 - smoothstep(0.1, 0.9, length(away) / u_extent);
      vec4 own = vec4(u_color.rgb * (0.72 - 0.3 * line), u_color.a);
      vec2 place = u_begin + away * u_repeats;
      if (u_covered) own = u_color * texture(u_texture, vec2(place.x, 1.0 - place.y));
      color = vec4(own.rgb, own.a * fade);
    }`,
};

// Triangles with a pressure at each corner, seen through what covers them: blue for none, over cyan,
// green and yellow to red at the pressure of the scale and above.
export const SURFACE = {
  vertex: `${HEAD}
    uniform mat4 u_matrix;
    uniform vec3 u_origin;
    uniform float u_scale;
    layout(location = 0) in vec3 a_corner;
    layout(location = 1) in float a_pressure;
    out float v_part;
    void main() {
      v_part = a_pressure / u_scale;
      gl_Position = u_matrix * vec4(u_origin + a_corner, 1.0);
    }`,
  fragment: `${HEAD}
    in float v_part;
    out vec4 color;
    void main() {
      float step = 4.0 * clamp(v_part, 0.0, 1.0);
      color = vec4(clamp(vec3(step - 2.0, min(step, 4.0 - step), 2.0 - step), 0.0, 1.0), 1.0);
    }`,
};
