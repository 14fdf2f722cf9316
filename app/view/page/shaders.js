// SPDX-License-Identifier: GPL-3.0-or-later
// The program's model of light on the graphics processor: core/optics/light_path.h for a ray,
// design/optics/facet.h and smooth.h for a triangle. Millimetres, lens frame.

const kSide = 2048;  // Numbers in a row of the textures that hold lists.

// Pixels: triangles that are thinner are drawn so wide.
const kWide = 0.01;

const kHead = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
ivec2 at(int i) { return ivec2(i % ${kSide}, i / ${kSide}); }
`;

// Vertices and triangles of the surface.
const kSurface = `
uniform sampler2D places;    // x y z
uniform sampler2D slopes;    // dz/dx dz/dy
uniform usampler2D corners;  // Of a mesh that is no grid.
uniform ivec2 grid;          // Vertices along x and y.
uniform int layout_;         // 0: corners are given, 1: one diagonal, 2: diagonals turn.
uniform bool facets;
vec3 place(int v) { return texelFetch(places, at(v), 0).xyz; }
ivec3 corners_of(int t) {
  if (layout_ == 0) {
    return ivec3(texelFetch(corners, at(3 * t), 0).x, texelFetch(corners, at(3 * t + 1), 0).x,
                 texelFetch(corners, at(3 * t + 2), 0).x);
  }
  int cell = t / 2, row = cell / (grid.x - 1);
  int a = row * grid.x + cell % (grid.x - 1), d = a + grid.x;
  if (layout_ == 2 && row % 2 == 0) return t % 2 == 0 ? ivec3(a, a + 1, d) : ivec3(a + 1, d + 1, d);
  return t % 2 == 0 ? ivec3(a, a + 1, d + 1) : ivec3(a, d + 1, d);
}
`;

// The way to the surface and after it.
const kLight = `
uniform bool mirror;
uniform float eta;         // Index of the lens.
uniform vec4 lamp;         // w 0: direction of parallel light; 1: place of a point.
uniform vec4 front;        // Apex and curvature of a lens's entry face.
uniform sampler2D heights; // Coefficients of a front that is a height map, two beyond each edge.
uniform vec4 samples_;     // Of the map along x and y, 0 if there is none, and their steps a mm.
uniform int steps;         // Towards where a ray enters.
uniform vec3 centre, right, up, away;  // Of the screen.

struct Ray { vec3 entry; vec3 way; float cosine; };

// The cubic B-splines around a place, in samples, and their slopes; straight on beyond the ends.
void splines(float t, float count, out vec4 value, out vec4 slope, out int first) {
  float inside = clamp(t, -1.0, count), cell = min(floor(inside), count - 1.0);
  float s = inside - cell, r = 1.0 - s;
  first = int(cell) + 1;
  value = vec4(r * r * r / 6.0, 2.0 / 3.0 - s * s * (1.0 - 0.5 * s),
               2.0 / 3.0 - r * r * (1.0 - 0.5 * r), s * s * s / 6.0);
  slope = vec4(-0.5 * r * r, s * (1.5 * s - 2.0), r * (2.0 - 1.5 * r), 0.5 * s * s);
  value += (t - inside) * slope;
}

// Height and slopes of a map.
vec3 on_map(vec2 x) {
  vec4 u, u_slope, v, v_slope;
  int i, j;
  splines(x.x * samples_.z, samples_.x, u, u_slope, i);
  splines(x.y * samples_.w, samples_.y, v, v_slope, j);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    vec4 c;
    for (int l = 0; l < 4; ++l) c[l] = texelFetch(heights, ivec2(i + l, j + k), 0).x;
    sum += vec3(v[k] * dot(u, c), v[k] * dot(u_slope, c), v_slope[k] * dot(u, c));
  }
  return vec3(sum.x, sum.yz * samples_.zw);
}

Ray through_front(vec2 x) {
  vec3 e, n;
  if (samples_.x > 0.0) {
    vec3 h = on_map(x);
    e = vec3(x, h.x);
    n = normalize(vec3(-h.yz, 1.0));
  } else {
    vec2 r = x - front.xy;
    float root = sqrt(max(0.0, 1.0 - front.w * front.w * dot(r, r)));
    e = vec3(x, front.z + front.w * dot(r, r) / (1.0 + root));
    n = normalize(vec3(-front.w * r / max(root, 1e-6), 1.0));
  }
  vec3 a = lamp.w > 0.0 ? normalize(e - lamp.xyz) : lamp.xyz;
  float c = dot(n, a);
  float inside = sqrt(max(0.0, 1.0 - (1.0 - c * c) / (eta * eta)));
  return Ray(e, (inside - c / eta) * n + a / eta, c > 0.0 ? inside : -1.0);
}

// The ray that comes to p: x moves to where the ray through it would have started. Every step
// leaves an error of the lens's thickness over the focal length of its front.
Ray ray_to(vec3 p) {
  if (mirror) return Ray(p, lamp.w > 0.0 ? normalize(p - lamp.xyz) : lamp.xyz, 1.0);
  Ray ray = through_front(p.xy);
  for (int i = 0; i < steps; ++i) {
    ray = through_front(p.xy - (p.z - ray.entry.z) * ray.way.xy / ray.way.z);
  }
  return ray;
}

// Right and up on the screen, mm from its centre, where light from p lands; z 0 if none does.
vec3 land(vec3 p, vec3 n) {
  vec3 a = ray_to(p).way;
  float c = dot(n, a);
  vec3 b;
  if (mirror) {
    if (c >= 0.0) return vec3(0.0);
    b = a - 2.0 * c * n;
  } else {
    float s = 1.0 + eta * eta * (c * c - 1.0);
    if (c <= 0.0 || s <= 0.0) return vec3(0.0);
    b = (sqrt(s) - eta * c) * n + eta * a;
  }
  float towards = dot(away, b), distance_ = dot(away, centre - p);
  if (b.z <= 0.0 || towards <= 0.0 || distance_ <= 0.0) return vec3(0.0);
  vec3 l = (p - centre) + b * (distance_ / towards);
  return vec3(dot(l, right), dot(l, up), 1.0);
}
`;

const kFullScreen = kHead + `
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
`;

// Places and slopes of a spline's nodes from its control points.
const kNodes = kHead + `
uniform sampler2D net_x, net_y, net_z;  // Offsets from an even grid.
uniform sampler2D along, across;        // Basis functions of every node: values, slopes.
uniform ivec2 net;                      // Control points along x and y.
uniform ivec2 grid;                     // Nodes.
uniform int samples;                    // Nodes per knot cell.
uniform int count;
uniform vec2 cell;                      // Of the knots, mm.
uniform float level;                    // Of the heights.
uniform bool bent;                      // False if the offsets along x and y are 0.
layout(location = 0) out vec4 place;
layout(location = 1) out vec4 slope;

vec4 row(sampler2D numbers, int first) {
  return vec4(texelFetch(numbers, at(first), 0).x, texelFetch(numbers, at(first + 1), 0).x,
              texelFetch(numbers, at(first + 2), 0).x, texelFetch(numbers, at(first + 3), 0).x);
}

// Sum and derivatives by the parameters.
vec3 sum(sampler2D numbers, ivec2 first, vec4 u, vec4 du, vec4 v, vec4 dv) {
  vec3 s = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    vec4 c = row(numbers, (first.y + k) * net.x + first.x);
    s += vec3(v[k] * dot(u, c), v[k] * dot(du, c), dv[k] * dot(u, c));
  }
  return s;
}

void main() {
  int i = int(gl_FragCoord.y) * ${kSide} + int(gl_FragCoord.x);
  place = slope = vec4(0.0);
  if (i >= count) return;
  ivec2 node = ivec2(i % grid.x, i / grid.x), first = min(node / samples, net - 4);
  vec4 u = texelFetch(along, at(2 * node.x), 0), du = texelFetch(along, at(2 * node.x + 1), 0),
       v = texelFetch(across, at(2 * node.y), 0), dv = texelFetch(across, at(2 * node.y + 1), 0);
  vec3 x = vec3(0.0), y = vec3(0.0), z = sum(net_z, first, u, du, v, dv);
  if (bent) { x = sum(net_x, first, u, du, v, dv); y = sum(net_y, first, u, du, v, dv); }
  x.y += cell.x;
  y.z += cell.y;
  place = vec4(cell * vec2(node) / float(samples) + vec2(x.x, y.x), level + z.x, 0.0);
  slope = vec4(vec2(z.y * y.z - z.z * y.y, z.z * x.y - z.y * x.z) / (x.y * y.z - y.y * x.z), 0.0, 0.0);
}
`;

// Where the light of every vertex lands, or of every facet's corners.
const kLanding = kHead + kSurface + kLight + `
uniform int count;
out vec4 landing;
void main() {
  int i = int(gl_FragCoord.y) * ${kSide} + int(gl_FragCoord.x);
  if (i >= count) { landing = vec4(0.0); return; }
  if (facets) {
    ivec3 v = corners_of(i / 3);
    vec3 p = place(v[0]), q = place(v[1]), r = place(v[2]);
    landing = vec4(land(i % 3 == 0 ? p : i % 3 == 1 ? q : r, normalize(cross(q - p, r - p))), 0.0);
  } else {
    landing = vec4(land(place(i), normalize(vec3(-texelFetch(slopes, at(i), 0).xy, 1.0))), 0.0);
  }
}
`;

// The light of every triangle: what goes to the screen, and what it takes.
const kTriangle = kHead + kSurface + kLight + `
uniform sampler2D landings;
uniform int count;
uniform vec4 source;   // Axis of a flat source; w 1: its light falls with the cosine.
uniform float scale;   // mm2 per steradian.
uniform bool loses;    // Faces reflect.
uniform bool varies;   // Rays come to the front under different angles.
out vec4 result;

float transmittance(float c) {
  float t = sqrt(max(0.0, 1.0 + eta * eta * (c * c - 1.0)));
  float across = (eta * c - t) / (eta * c + t), along = (c - eta * t) / (c + eta * t);
  return 1.0 - 0.5 * (across * across + along * along);
}

float passage(vec3 p, vec3 q, vec3 r) {
  Ray ray = ray_to((p + q + r) / 3.0);
  float both = transmittance(varies ? ray.cosine : 1.0) *
               transmittance(dot(normalize(cross(q - p, r - p)), ray.way));
  return both / (transmittance(1.0) * transmittance(1.0));
}

float intake(vec3 p, vec3 q, vec3 r) {
  vec3 a = ray_to(p).entry, b = ray_to(q).entry, c = ray_to(r).entry;
  vec3 area = cross(b - a, c - a);
  if (lamp.w == 0.0) return 0.5 * dot(area, lamp.xyz) / lamp.z;
  a -= lamp.xyz; b -= lamp.xyz; c -= lamp.xyz;
  float la = length(a), lb = length(b), lc = length(c);
  float d = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  float even = scale * 2.0 * atan(dot(a, area), d);
  return source.w > 0.0 ? even * dot(source.xyz, normalize(a + b + c)) : even;
}

void main() {
  int t = int(gl_FragCoord.y) * ${kSide} + int(gl_FragCoord.x);
  result = vec4(0.0);
  if (t >= count) return;
  ivec3 v = corners_of(t), l = facets ? ivec3(3 * t, 3 * t + 1, 3 * t + 2) : v;
  vec3 p = place(v[0]), q = place(v[1]), r = place(v[2]);
  float flux = intake(p, q, r);
  if (loses) flux *= passage(p, q, r);
  vec3 a = texelFetch(landings, at(l[0]), 0).xyz, b = texelFetch(landings, at(l[1]), 0).xyz,
       c = texelFetch(landings, at(l[2]), 0).xyz;
  bool lit = a.z * b.z * c.z > 0.0 && flux > 0.0;
  result = vec4(lit ? flux : 0.0, flux, 0.0, 0.0);
}
`;

// The light of the image triangles in every pixel: a point covers the pixels of a cell's two
// triangles, or of one triangle. a, b, c and a, c, d are the corners, in pixels.
const kDraw = kHead + kSurface + `
uniform sampler2D landings;
uniform sampler2D fluxes;
uniform ivec4 part;   // Of the picture that is drawn: first pixel and count, each way.
uniform vec2 pixels;  // Of the picture.
uniform vec2 halves;  // Of the screen that is shown, mm.
uniform float weight;
uniform bool pairs;
flat out vec4 ab, cd;
flat out vec2 light;
flat out float inside;  // 1 if all of it is in one pixel.

float flux(int t) { return weight * texelFetch(fluxes, at(t), 0).x; }
vec2 landing(int i) { return (0.5 + 0.5 * texelFetch(landings, at(i), 0).xy / halves) * pixels; }

void main() {
  int n = gl_VertexID;
  ivec4 corner;
  if (pairs) {
    ivec3 s = corners_of(2 * n), t = corners_of(2 * n + 1);
    bool other = layout_ == 2 && s.z == t.z;
    corner = other ? ivec4(t, s.x) : ivec4(s, t.z);
    light = other ? vec2(flux(2 * n + 1), flux(2 * n)) : vec2(flux(2 * n), flux(2 * n + 1));
  } else {
    corner = facets ? ivec4(3 * n, 3 * n + 1, 3 * n + 2, 3 * n) : corners_of(n).xyzx;
    light = vec2(flux(n), 0.0);
  }
  vec2 a = landing(corner.x), c = landing(corner.z);
  vec2 b = light.x > 0.0 ? landing(corner.y) : a, d = light.y > 0.0 ? landing(corner.w) : a;
  ab = vec4(a, b);
  cd = vec4(c, d);
  vec2 first = vec2(part.xy), size = vec2(part.zw);
  vec2 least = min(min(a, b), min(c, d)), most = max(max(a, b), max(c, d));
  inside = floor(least) == floor(most) ? 1.0 : 0.0;
  float wide = inside > 0.0 ? 0.0 : ${kWide};
  vec2 low = clamp(floor(least - wide) - first, vec2(0.0), size);
  vec2 high = clamp(floor(most + wide) + 1.0 - first, vec2(0.0), size);
  float side = max(high.x - low.x, high.y - low.y);
  bool seen = light.x + light.y > 0.0 && high.x > low.x && high.y > low.y;
  // A point whose centre is outside is not drawn.
  vec2 half_ = 0.5 * min(vec2(side), size);
  vec2 middle = clamp(low + 0.5 * side, half_, size - half_);
  gl_Position = seen ? vec4(2.0 * middle / size - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = max(side, 1.0);
}
`;
const kAdd = kHead + `
flat in vec4 ab, cd;
flat in vec2 light;
flat in float inside;
out vec4 sum;

float cross_(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

// Area between an edge and the lower side of the pixel [0, 1]², inside the pixel, signed by the
// edge's way along x (Green's theorem, as design/flux/).
float below(vec2 a, vec2 b) {
  float from = clamp(a.x, 0.0, 1.0), to = clamp(b.x, 0.0, 1.0);
  if (from == to) return 0.0;
  float rise = (b.y - a.y) / (b.x - a.x);
  float y = a.y + rise * (from - a.x), z = a.y + rise * (to - a.x);
  float low = min(y, z), high = max(y, z), floor_ = clamp(low, 0.0, 1.0), roof = clamp(high, 0.0, 1.0);
  float mean = high - low > 1e-6
    ? (0.5 * (roof - floor_) * (roof + floor_) + max(0.0, high - max(low, 1.0))) / (high - low)
    : floor_;
  return (to - from) * mean;
}

// Share of a triangle in the pixel. One that is as good as a line is widened, since rounding would
// make its share anything.
float share(vec2 a, vec2 b, vec2 c) {
  float twice = cross_(b - a, c - a);
  if (abs(twice) < ${kWide * kWide}) {
    vec2 p = b - a, q = c - b, r = a - c;
    if (dot(q, q) > dot(p, p) && dot(q, q) >= dot(r, r)) { vec2 s = a; a = b; b = c; c = s; }
    else if (dot(r, r) > dot(p, p)) { vec2 s = b; b = a; a = c; c = s; }
    float length_ = distance(a, b), side = twice < 0.0 ? -1.0 : 1.0;
    vec2 way = length_ > 1e-6 ? (b - a) / length_ : vec2(1.0, 0.0);
    if (length_ < ${kWide}) b = a + ${kWide} * way;
    c += side * ${kWide} * vec2(-way.y, way.x);
    twice = cross_(b - a, c - a);
  }
  return abs(below(a, b) + below(b, c) + below(c, a)) / (0.5 * abs(twice));
}

void main() {
  if (inside > 0.0) {
    sum = vec4(light.x + light.y, 0.0, 0.0, 0.0);
    return;
  }
  vec2 pixel = floor(gl_FragCoord.xy), a = ab.xy - pixel, c = cd.xy - pixel;
  float light_ = 0.0;
  if (light.x > 0.0) light_ += light.x * share(a, ab.zw - pixel, c);
  if (light.y > 0.0) light_ += light.y * share(a, c, cd.zw - pixel);
  sum = vec4(light_, 0.0, 0.0, 0.0);
}
`;

// The picture from the sum over the source's points; row 0 at the bottom.
const kPixels = kHead + `
uniform sampler2D sums;
uniform float gain;
out vec4 mean;
void main() { mean = vec4(gain * texelFetch(sums, ivec2(gl_FragCoord.xy), 0).x, 0.0, 0.0, 1.0); }
`;

// What the eye sees: display-encoded, with the colour of the light.
const kShow = kHead + `
uniform sampler2D picture;
uniform vec2 size;       // Of the canvas, pixels.
uniform float exposure;  // Factor.
out vec4 color;
float value(ivec2 p) { return texelFetch(picture, clamp(p, ivec2(0), textureSize(picture, 0) - 1), 0).x; }
void main() {
  vec2 p = gl_FragCoord.xy / size * vec2(textureSize(picture, 0)) - 0.5;
  ivec2 i = ivec2(floor(p));
  vec2 f = p - floor(p);
  float light = exposure * mix(mix(value(i), value(i + ivec2(1, 0)), f.x),
                               mix(value(i + ivec2(0, 1)), value(i + ivec2(1, 1)), f.x), f.y);
  float shown = light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1.0 / 2.4) - 0.055;
  color = vec4(vec3(clamp(shown, 0.0, 1.0)), 1.0);
}
`;
