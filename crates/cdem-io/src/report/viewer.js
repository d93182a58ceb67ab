// The moving picture: triangles and edges on the graphics card, their colours, the clock.

// Even steps of lightness, from low to high: told apart without seeing colours, too.
const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779",
  "#6ece58", "#b5de2b", "#fde725"];
const PLASMA = ["#0d0887", "#46039f", "#7201a8", "#9c179e", "#bd3786", "#d8576b", "#ed7953",
  "#fb9f3a", "#fdca26", "#f0f921"];

// For blocks: apart in lightness as well as in hue, so that they are told apart by eyes that lack
// one of the three kinds of cones. The curves of charts have the same hues.
const BLOCK_COLOURS = ["#3a88c8", "#e69f00", "#35b98c", "#c24a12", "#9ad4f7", "#9c2163",
  "#f2e55c", "#4a3096"];
const FIXED_COLOUR = "#9aa0a6";

function rgb(hex) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
}

function mixed(a, b, share) {
  return a.map((component, i) => Math.round(component + share * (b[i] - component)));
}

// Colour of a block; when colours are used up they come again, lighter and then darker.
function blockColour(number) {
  const colour = rgb(BLOCK_COLOURS[number % BLOCK_COLOURS.length]);
  const round = Math.floor(number / BLOCK_COLOURS.length) % 3;
  if (round === 0) return colour;
  return round === 1 ? mixed(colour, [255, 255, 255], 0.45) : mixed(colour, [0, 0, 0], 0.35);
}

// Colours of all values that a byte can have.
function colourTable(stops) {
  const colours = stops.map(rgb);
  const table = new Uint8Array(256 * 4);
  for (let value = 0; value < 256; value++) {
    const at = (value / 255) * (colours.length - 1);
    const low = Math.min(colours.length - 2, Math.floor(at));
    table.set([...mixed(colours[low], colours[low + 1], at - low), 255], 4 * value);
  }
  return table;
}

// Fields for colours, the default first. In 3-D the default is the block, because light and
// shadow are invisible on the dark colours of blocks at rest.
function fieldsOf(motion, dimension) {
  const block = { name: "block", label: "block" };
  const speed = { name: "speed", label: "speed", unit: "m/s", scale: motion.speed_scale,
    stops: VIRIDIS, ofPoints: true };
  const stress = { name: "stress", label: "von Mises stress", unit: "Pa",
    scale: motion.stress_scale, stops: PLASMA, ofPoints: false };
  const known = [speed, stress].filter(({ scale }) => scale > 0);
  return dimension === 3 ? [block, ...known] : [...known, block];
}

// Numbers of the colours of blocks: those in the charts have the colours of their curves.
function colourNumbers({ blocks, block_rows: rows }) {
  const charted = new Map(rows.blocks.map(({ name }, i) => [name, i]));
  let next = charted.size;
  return blocks.map(({ name, fixed }) => (fixed ? null : charted.get(name) ?? next++));
}

// Four bytes for each block; at least so many that blocks nobody listed differ as well.
function blockColourTable(numbers) {
  const listed = numbers.length > 0 ? numbers : BLOCK_COLOURS.map((_, i) => i);
  const colourOf = (number) => (number === null ? rgb(FIXED_COLOUR) : blockColour(number));
  const colours = listed.map(colourOf);
  return Uint8Array.from(colours.flatMap((colour) => [...colour, 255]));
}

// The key to the colours of a field.
function colourKey(field, blocks, numbers) {
  if (field.stops) return valueKey(field);
  const item = (colour, text) => {
    const patch = htmlElement("i", { class: "patch" });
    patch.style.background = `rgb(${colour})`;
    return htmlElement("span", {}, patch, text);
  };
  const moving = blocks.map(({ name }, i) => [name, numbers[i]]).filter(([, n]) => n !== null);
  const items = moving.length <= BLOCK_COLOURS.length
    ? moving.map(([name, number]) => item(blockColour(number), name))
    : [htmlElement("span", {}, "Each block has one colour; colours repeat.")];
  if (numbers.includes(null)) items.push(item(rgb(FIXED_COLOUR), "fixed"));
  return htmlElement("div", { class: "key" }, ...items);
}

function valueKey({ label, unit, scale, stops }) {
  const prefix = prefixOf(scale);
  const bar = htmlElement("div", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) =>
    htmlElement("span", {}, significant((share * scale) / prefix.factor, 3)));
  const name = htmlElement("span", {}, `${label}, ${prefix.symbol}${unit}`);
  const values = htmlElement("div", { class: "values" }, ...ticks);
  return htmlElement("div", { class: "key" }, name, htmlElement("div", {}, bar, values));
}

// Triangles and edges hold numbers of points, and the positions of points lie in textures: the
// shaders look them up, so that a frame is one upload and nothing is ever expanded here.
const TEXTURE_WIDTH = 2048;

const LOOKING_UP = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform usampler2D pointsNow;
uniform usampler2D pointsNext;
uniform vec3 extent;
uniform float progress;
uniform mat4 camera;

ivec2 place(uint number) {
  return ivec2(number % ${TEXTURE_WIDTH}u, number / ${TEXTURE_WIDTH}u);
}

// Position of a point relative to the middle of the box, m.
vec3 position(uint number) {
  vec3 now = vec3(texelFetch(pointsNow, place(number), 0).xyz);
  vec3 next = vec3(texelFetch(pointsNext, place(number), 0).xyz);
  return extent * (mix(now, next, progress) / 65535.0 - 0.5);
}
`;

const FILL_VERTEX = `${LOOKING_UP}
uniform usampler2D triangles;
uniform usampler2D block;
uniform sampler2D blockColours;
uniform int blockCount;
uniform sampler2D valuesNow;
uniform sampler2D valuesNext;
uniform int valuesOfPoints;
flat out vec3 normal;
flat out vec3 colourOfBlock;
out float value;

void main() {
  uint triangle = uint(gl_VertexID / 3);
  uvec3 corners = texelFetch(triangles, place(triangle), 0).xyz;
  vec3 first = position(corners.x);
  vec3 second = position(corners.y);
  vec3 third = position(corners.z);
  normal = cross(second - first, third - first);
  int corner = gl_VertexID % 3;
  vec3 own = corner == 0 ? first : corner == 1 ? second : third;
  gl_Position = camera * vec4(own, 1.0);

  uint owner = texelFetch(block, place(triangle), 0).x % uint(blockCount);
  colourOfBlock = texelFetch(blockColours, place(owner), 0).rgb;
  ivec2 at = place(valuesOfPoints == 1 ? corners[corner] : triangle);
  value = mix(texelFetch(valuesNow, at, 0).x, texelFetch(valuesNext, at, 0).x, progress);
}
`;

const FILL_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform sampler2D colourTable;
uniform int byBlock;
uniform vec3 light;
uniform float ambient;
flat in vec3 normal;
flat in vec3 colourOfBlock;
in float value;
out vec4 paint;

void main() {
  vec3 colour = byBlock == 1
    ? colourOfBlock
    : texture(colourTable, vec2((value * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  vec3 towards = (gl_FrontFacing ? normal : -normal) / max(length(normal), 1e-30);
  float shade = mix(ambient, 1.0, 0.5 + 0.5 * dot(towards, light));
  paint = vec4(colour * shade, 1.0);
}
`;

// Edges are strips as wide as asked for: what graphics cards call lines is one pixel wide.
const EDGE_VERTEX = `${LOOKING_UP}
uniform usampler2D edges;
uniform vec2 viewport;
uniform float width;
uniform float near;
uniform float fadeLength;
out float strength;

void main() {
  uvec2 ends = texelFetch(edges, place(uint(gl_VertexID / 6)), 0).xy;
  vec4 a = camera * vec4(position(ends.x), 1.0);
  vec4 b = camera * vec4(position(ends.y), 1.0);
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = 0.5 * viewport * (b.xy / b.w - a.xy / a.w);
  float pixels = length(along);
  vec2 across = pixels > 0.0 ? vec2(-along.y, along.x) / pixels : vec2(0.0);

  int corner = gl_VertexID % 6;
  bool atEnd = corner == 1 || corner == 2 || corner == 4;
  float side = corner == 2 || corner == 4 || corner == 5 ? 1.0 : -1.0;
  gl_Position = atEnd ? b : a;
  gl_Position.xy += side * across * width / viewport * gl_Position.w;
  // In front of the faces that it bounds.
  gl_Position.z -= 1e-4 * gl_Position.w;
  // Edges of elements that are a few pixels small would hide all colours.
  strength = fadeLength > 0.0 ? smoothstep(0.0, fadeLength, pixels) : 1.0;
}
`;

const EDGE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 ink;
in float strength;
out vec4 paint;

void main() {
  paint = vec4(ink.rgb, ink.a * strength);
}
`;

const ELEMENT_INK = [0.05, 0.06, 0.08, 0.42];
// Seen on light and on dark grounds.
const OUTLINE_INK = [0.36, 0.39, 0.44, 1];

function compiled(gl, kind, source) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

// A program and the places of its uniforms.
function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`shaders: ${gl.getProgramInfoLog(program)}`);
  }
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

// Arrays in textures, each on a texture unit of its own.
class Arrays {
  constructor(gl) {
    this.gl = gl;
    const layouts = {
      points: [gl.RGB16UI, gl.RGB_INTEGER, gl.UNSIGNED_SHORT, 3],
      triples: [gl.RGB32UI, gl.RGB_INTEGER, gl.UNSIGNED_INT, 3],
      pairs: [gl.RG32UI, gl.RG_INTEGER, gl.UNSIGNED_INT, 2],
      numbers: [gl.R16UI, gl.RED_INTEGER, gl.UNSIGNED_SHORT, 1],
      shares: [gl.R8, gl.RED, gl.UNSIGNED_BYTE, 1],
      colours: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, 4],
    };
    const kinds = { pointsNow: "points", pointsNext: "points", valuesNow: "shares",
      valuesNext: "shares", triangles: "triples", block: "numbers", elementEdges: "pairs",
      outline: "pairs", blockColours: "colours", colourTable: "colours" };
    this.slots = {};
    Object.entries(kinds).forEach(([name, kind], unit) => {
      this.slots[name] = { unit, layout: layouts[kind], texture: gl.createTexture() };
    });
    // Rows of a texture follow each other without gaps.
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  }

  set(name, array) {
    const { gl } = this;
    const { unit, layout, texture } = this.slots[name];
    const [inside, format, type, each] = layout;
    const items = Math.max(1, array.length / each);
    const width = Math.min(items, TEXTURE_WIDTH);
    const height = Math.ceil(items / width);
    let whole = array;
    if (array.length < width * height * each) {
      whole = new array.constructor(width * height * each);
      whole.set(array);
    }
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, whole);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    }
  }

  // Lets the samplers of a program read arrays: {name in the shader: name here}.
  bind({ at }, names) {
    for (const [sampler, name] of Object.entries(names)) {
      this.gl.uniform1i(at[sampler], this.slots[name].unit);
    }
  }
}

// Faces meet at an edge that is drawn as an outline when they are this far from one plane.
const SHARP = Math.cos(Math.PI / 6);

// Edges of triangles that have no neighbour there, or a neighbour around a corner: pairs of
// points. `points` are shares of a box of that extent.
function outlineOf(triangles, points, extent) {
  const pointCount = points.length / 3;
  const normals = unitNormals(triangles, points, extent);
  const alone = new Map();
  const outline = [];
  for (let i = 0; i < triangles.length; i++) {
    const start = i - (i % 3);
    const [a, b] = [triangles[i], triangles[start + ((i + 1) % 3)]];
    const edge = Math.min(a, b) * pointCount + Math.max(a, b);
    const other = alone.get(edge);
    if (other === undefined) {
      alone.set(edge, start);
      continue;
    }
    alone.delete(edge);
    let cosine = 0;
    for (let c = 0; c < 3; c++) cosine += normals[start + c] * normals[other + c];
    if (cosine < SHARP) outline.push(a, b);
  }
  for (const edge of alone.keys()) outline.push(Math.floor(edge / pointCount), edge % pointCount);
  return Uint32Array.from(outline);
}

// Three components for each triangle.
function unitNormals(triangles, points, extent) {
  const normals = new Float32Array(triangles.length);
  for (let start = 0; start < triangles.length; start += 3) {
    const [a, b, c] = [0, 1, 2].map((corner) => 3 * triangles[start + corner]);
    const from = (point, i) => extent[i] * (points[point + i] - points[a + i]);
    const normal = [0, 1, 2].map((i) => {
      const [j, k] = [(i + 1) % 3, (i + 2) % 3];
      return from(b, j) * from(c, k) - from(b, k) * from(c, j);
    });
    const size = Math.hypot(...normal) || 1;
    for (let i = 0; i < 3; i++) normals[start + i] = normal[i] / size;
  }
  return normals;
}

// Draws moments of the motion on a canvas.
class Renderer {
  // `blockColours` holds four bytes for each block.
  constructor(canvas, motion, dimension, blockColours) {
    const wishes = { antialias: true, alpha: true, depth: true };
    const gl = canvas.getContext("webgl2", wishes);
    if (!gl) throw new MissingPart("WebGL2");
    Object.assign(this, { canvas, motion, dimension, gl });
    this.extent = motion.high.map((high, i) => high - motion.low[i]);
    this.fill = linked(gl, FILL_VERTEX, FILL_FRAGMENT);
    this.edge = linked(gl, EDGE_VERTEX, EDGE_FRAGMENT);
    this.arrays = new Arrays(gl);
    this.arrays.set("blockColours", blockColours);
    this.blockCount = blockColours.length / 4;
    // Pixels of the canvas to one of the page.
    this.density = 1;
    this.drawn = 0;
  }

  // A moment lies between two frames: {now, next, progress}. `field` says what colours tell.
  draw(moment, camera, field, withEdges) {
    const { gl, canvas } = this;
    this.load(moment, field);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl[this.dimension === 3 ? "enable" : "disable"](gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    const matrix = camera.matrix(canvas.width / canvas.height);
    this.drawFill(moment, camera, matrix, field);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const edge = { moment, camera, matrix };
    if (withEdges) {
      this.drawEdges({ ...edge, name: "elementEdges", width: 1, ink: ELEMENT_INK, fadeLength: 14 });
    }
    this.drawEdges({ ...edge, name: "outline", width: 1.4, ink: OUTLINE_INK, fadeLength: 0 });
    gl.disable(gl.BLEND);
    this.drawn += 1;
  }

  // Brings to the graphics card what is not there yet.
  load({ now, next }, field) {
    const frame = this.motion.frames[now];
    if (this.topology !== frame.topology) this.loadTopology(frame);
    this.loadFrame("Now", now, field);
    this.loadFrame("Next", next, field);
    if (field.stops && this.stops !== field.stops) {
      this.arrays.set("colourTable", colourTable(field.stops));
      this.stops = field.stops;
    }
  }

  loadTopology(frame) {
    const topology = this.motion.topologies[frame.topology];
    topology.outline ??= outlineOf(topology.triangles, frame.points, this.extent);
    this.arrays.set("triangles", topology.triangles);
    this.arrays.set("block", topology.block);
    this.arrays.set("elementEdges", topology.edges);
    this.arrays.set("outline", topology.outline);
    this.counts = { triangles: topology.triangles.length / 3,
      elementEdges: topology.edges.length / 2, outline: topology.outline.length / 2 };
    this.topology = frame.topology;
  }

  loadFrame(which, number, field) {
    const held = `${number} ${field.name}`;
    if (this[`held${which}`] === held) return;
    const frame = this.motion.frames[number];
    this.arrays.set(`points${which}`, frame.points);
    this.arrays.set(`values${which}`, frame[field.name] ?? new Uint8Array(1));
    this[`held${which}`] = held;
  }

  // Uniforms that fill and edges share.
  use(shaders, moment, matrix) {
    const { gl } = this;
    gl.useProgram(shaders.program);
    gl.uniformMatrix4fv(shaders.at.camera, false, matrix);
    gl.uniform3fv(shaders.at.extent, this.extent);
    gl.uniform1f(shaders.at.progress, moment.progress);
  }

  drawFill(moment, camera, matrix, field) {
    const { gl } = this;
    const { at } = this.fill;
    this.use(this.fill, moment, matrix);
    const own = ["pointsNow", "pointsNext", "valuesNow", "valuesNext", "triangles", "block",
      "blockColours", "colourTable"];
    this.arrays.bind(this.fill, Object.fromEntries(own.map((name) => [name, name])));
    gl.uniform1i(at.blockCount, this.blockCount);
    gl.uniform1i(at.byBlock, field.stops ? 0 : 1);
    gl.uniform1i(at.valuesOfPoints, field.ofPoints ? 1 : 0);
    gl.uniform3fv(at.light, camera.light);
    gl.uniform1f(at.ambient, camera.ambient);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * this.counts.triangles);
  }

  // `width` is in pixels of the page.
  drawEdges({ moment, camera, matrix, name, width, ink, fadeLength }) {
    const { gl, canvas } = this;
    const { at } = this.edge;
    this.use(this.edge, moment, matrix);
    this.arrays.bind(this.edge, { pointsNow: "pointsNow", pointsNext: "pointsNext", edges: name });
    gl.uniform2f(at.viewport, canvas.width, canvas.height);
    gl.uniform1f(at.width, width * this.density);
    gl.uniform1f(at.near, camera.near);
    gl.uniform1f(at.fadeLength, fadeLength * this.density);
    gl.uniform4fv(at.ink, ink);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * this.counts[name]);
  }

  // Makes the canvas as fine as the screen; tells whether its size is another.
  resize(density) {
    const { canvas } = this;
    const size = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * density));
    if (canvas.width === size[0] && canvas.height === size[1]) return false;
    [canvas.width, canvas.height] = size;
    this.density = density;
    return true;
  }

  // A frame as an image; what the canvas showed has to be drawn again.
  picture(number, camera, field, { width, height, density }) {
    const { canvas } = this;
    [canvas.width, canvas.height] = [width, height];
    this.density = density;
    this.draw({ now: number, next: number, progress: 0 }, camera, field, true);
    return canvas.toDataURL("image/png");
  }
}

// A part of the browser that the animation needs, and that this one has not.
class MissingPart extends Error {}

// The clock of the animation.
class Player {
  // `changed` is called whenever the time is another, and when it starts or stops.
  constructor(frames, changed) {
    this.times = frames.map((frame) => frame.time);
    this.topologies = frames.map((frame) => frame.topology);
    this.changed = changed;
    [this.start, this.end] = [this.times[0], this.times.at(-1)];
    this.time = this.start;
    this.playing = false;
    // Duration of the whole animation, s.
    this.duration = 8;
  }

  // The last frame that is not later.
  frame() {
    let number = nearest(this.times, this.time);
    if (this.times[number] > this.time) number -= 1;
    return Math.max(0, number);
  }

  // Between frames of the same triangles points go straight; other triangles appear at once.
  moment() {
    const now = this.frame();
    const next = now + 1;
    if (next >= this.times.length || this.topologies[next] !== this.topologies[now]) {
      return { now, next: now, progress: 0 };
    }
    const apart = this.times[next] - this.times[now];
    return { now, next, progress: apart > 0 ? (this.time - this.times[now]) / apart : 0 };
  }

  seek(time) {
    this.time = Math.min(this.end, Math.max(this.start, time));
    this.changed();
  }

  // To the next frame or the one before.
  step(direction) {
    this.pause();
    const now = this.frame();
    const between = this.time > this.times[now];
    const to = direction < 0 && between ? now : now + direction;
    this.seek(this.times[Math.min(this.times.length - 1, Math.max(0, to))]);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.time >= this.end) this.time = this.start;
    this.playing = true;
    this.changed();
    // A clock that was paused and started again within one tick must not tick twice.
    const run = {};
    this.run = run;
    let before = null;
    const tick = (now) => {
      if (!this.playing || this.run !== run) return;
      const passed = before === null ? 0 : (now - before) / 1000;
      before = now;
      this.advance(passed);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  advance(passed) {
    const time = this.time + (passed / this.duration) * (this.end - this.start);
    if (time >= this.end) this.playing = false;
    this.seek(time);
  }

  pause() {
    this.playing = false;
    this.changed();
  }
}
