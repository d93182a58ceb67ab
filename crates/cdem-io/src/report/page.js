// Puts the page together.

const root = document.documentElement;
const byId = (id) => document.getElementById(id);

// Sums of many numbers that should cancel leave this share of them.
const ROUND_OFF = 1e-9;

// Rows of the table of blocks, at most.
const LISTED_BLOCKS = 200;

// Errors after loading are counted, for tests of the page.
function countErrors() {
  root.dataset.errors = "0";
  const another = () => {
    root.dataset.errors = String(Number(root.dataset.errors) + 1);
  };
  window.addEventListener("error", another);
  window.addEventListener("unhandledrejection", another);
}

// Follows the system until the reader chooses.
function followTheme() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const set = (dark) => {
    root.dataset.theme = dark ? "dark" : "light";
  };
  const follow = () => set(system.matches);
  follow();
  system.addEventListener("change", follow);
  return () => {
    system.removeEventListener("change", follow);
    set(root.dataset.theme !== "dark");
  };
}

function connectThemeButton(toggle) {
  const button = byId("theme");
  const name = () => {
    button.textContent = root.dataset.theme === "dark" ? "Light theme" : "Dark theme";
  };
  name();
  new MutationObserver(name).observe(root, { attributeFilter: ["data-theme"] });
  button.addEventListener("click", toggle);
}

// Most energy that was in the blocks or went through loads and gravity, J: what residuals are
// held against.
function energyExchanged(history) {
  const start = (history.kinetic_energy?.[0] ?? 0) + (history.strain_energy?.[0] ?? 0);
  let most = Math.max(0, start);
  for (let row = 0; row < (history.time?.length ?? 0); row++) {
    const [external, gravity] = [history.external_work[row], history.gravity_work[row]];
    most = Math.max(most, Math.abs(external), Math.abs(gravity), start + external + gravity);
  }
  return most;
}

function showHead({ title, version, summary, history }) {
  const ran = summary?.version ?? version;
  const by = ran === version ? "" : `; this page by ${version}`;
  byId("eyebrow").textContent = `Report of a run of cdem ${ran}${by}`;
  byId("title").textContent = title || document.title;
  const status = byId("status");
  if (summary) {
    status.dataset.status = summary.status;
    const when = `at t = ${quantity(summary.time, "s")} after ${counted(summary.steps, "step")}`;
    const word = summary.status[0].toUpperCase() + summary.status.slice(1);
    const why = summary.reason ? `: ${summary.reason}` : "";
    status.append(htmlElement("strong", {}, word), ` ${when}${why}`);
  } else {
    const last = history.time?.at(-1);
    const until = last === undefined ? "" : ` The results reach t = ${quantity(last, "s")}.`;
    status.dataset.status = "unknown";
    status.append(htmlElement("strong", {}, "Unfinished"),
      ` – there is no summary yet: the run is still going on, or was killed.${until}`);
  }
}

function showWarnings(warnings) {
  if (warnings.length === 0) return;
  byId("warnings-title").textContent = counted(warnings.length, "warning");
  byId("warnings-list").append(...warnings.map((text) => htmlElement("li", {}, text)));
  byId("warnings").hidden = false;
}

function elementsFact({ history, summary }) {
  const elements = history.elements ?? [];
  if (elements.length === 0) {
    const levels = summary?.levels ?? [];
    return levels.length > 0 ? count(levels.reduce((sum, of) => sum + of, 0)) : NOTHING;
  }
  const most = largest(elements);
  if (most === elements[0]) return count(most);
  return `${count(elements[0])} at the start, ${count(most)} at most`;
}

function modelFacts(data) {
  const { blocks, dimension } = data;
  const fixed = blocks.filter((block) => block.fixed).length;
  const blockFact = fixed > 0 ? `${count(blocks.length)}, ${count(fixed)} of them fixed`
    : count(blocks.length);
  return [
    ["Dimension", dimension === 2 ? "2-D" : "3-D"],
    ["Blocks", blocks.length > 0 ? blockFact : NOTHING],
    ["Elements", elementsFact(data)],
  ];
}

function runFacts(summary, exchanged) {
  const levels = summary.levels.filter((number) => number > 0).length > 1
    ? [["Elements per time level", summary.levels.map(count).join(", ")]] : [];
  const memory = summary.peak_memory_bytes === null ? []
    : [["Peak memory", quantity(summary.peak_memory_bytes, "B", 3)]];
  const residual = exchanged > 0 ? percent(summary.energy_residual, exchanged)
    : quantity(summary.energy_residual, "J");
  const deepest = summary.max_penetration < 1e-12 ? "none" : quantity(summary.max_penetration, "m");
  return [
    ["Simulated time", quantity(summary.time, "s")],
    ["Steps", `${count(summary.steps)} of ${quantity(summary.step, "s")}`],
    ["Wall time", duration(summary.wall_seconds)],
    ["Setup time", duration(summary.setup_seconds)],
    ["Speed", `${quantity(summary.updates_per_second, " element updates/s", 3)}`],
    ["Threads", count(summary.threads)],
    ["Contacts begun", count(summary.contacts_begun)],
    ["Deepest penetration", deepest],
    ["Energy residual", residual],
    ...levels,
    ...memory,
  ];
}

function showFacts(data) {
  const { summary, history } = data;
  const facts = modelFacts(data);
  if (summary) {
    facts.push(...runFacts(summary, energyExchanged(history)));
  } else if (history.time?.length > 0) {
    facts.push(["Simulated time", quantity(history.time.at(-1), "s")],
      ["Steps", count(history.step.at(-1))]);
  }
  const pairs = facts.map(([name, value]) =>
    htmlElement("div", {}, htmlElement("dt", {}, name), htmlElement("dd", {}, value)));
  byId("facts").append(...pairs);
}

// Columns of the ledger: [column, name, colour, dashed].
const STORED = [["kinetic_energy", "kinetic", 1], ["strain_energy", "strain", 3]];
const WORK = [
  ["external_work", "work of external forces", 2],
  ["gravity_work", "work of gravity", 8],
];
const LOSSES = [
  ["impact_loss", "impact loss", 4],
  ["friction_loss", "friction loss", 6],
  ["damping_loss", "damping loss", 5],
  ["fracture_loss", "fracture loss", 7],
  ["remesh_loss", "remesh loss", 4, true],
  ["correction_loss", "correction loss", 6, true],
];

function showEnergies(charts, history) {
  const exchanged = energyExchanged(history);
  const matters = ([column]) => largest(history[column]) > ROUND_OFF * exchanged;
  const entries = [...STORED, ...[...WORK, ...LOSSES].filter(matters)];
  const series = entries.map(([column, name, colour, dashed = false]) =>
    ({ name, values: history[column], colour, dashed }));
  charts.add("energies", { title: "Energy", unit: "J", series });
  if (!(exchanged > 0)) return;
  const shares = history.energy_residual.map((joule) =>
    (joule === null ? null : (100 * joule) / exchanged));
  const residual = { name: "", values: shares, colour: 1 };
  const title = "Residual of the energy ledger, share of the largest energy exchanged";
  charts.add("energies", { title, unit: "%", series: [residual] });
  byId("ledger").append(ledger(history, entries, exchanged));
}

// Energies at the start and at the end.
function ledger(history, entries, exchanged) {
  const all = [...entries, ["energy_residual", "residual"]];
  const at = (row) => all.map(([column]) => history[column].at(row));
  const [start, end] = [at(0), at(-1)];
  const columns = [{ name: "" }, ...["start", "end", "share at the end"].map((name) =>
    ({ name, kind: "number" }))];
  const rows = all.map(([, name], i) =>
    [name, quantity(start[i], "J"), quantity(end[i], "J"), percent(end[i], exchanged)]);
  const most = quantity(exchanged, "J");
  return table(`The energy ledger, with shares of the largest energy exchanged, ${most}`, columns, rows);
}

// Curves of those components of vectors that are not all round-off.
function components(history, vectors, least) {
  const colours = { x: 1, y: 4, z: 3 };
  const columns = vectors.flatMap(({ column, name, dashed }) =>
    Object.entries(colours).map(([axis, colour]) =>
      ({ name: `${name} ${axis}`, values: history[`${column}_${axis}`], colour, dashed })));
  const most = Math.max(least, largest(...columns.map(({ values }) => values)));
  return columns.filter(({ values }) => largest(values) > ROUND_OFF * most);
}

function showMomentum(charts, { history, blocks, motion }) {
  // All the energy could move all the mass so fast; less than its round-off is none.
  const moving = blocks.filter((block) => !block.fixed);
  const mass = moving.reduce((sum, block) => sum + block.mass, 0);
  const possible = Math.sqrt(2 * mass * energyExchanged(history));
  const arm = motion ? Math.hypot(...motion.high.map((high, i) => high - motion.low[i])) : 0;
  const linear = [{ column: "momentum", name: "momentum", dashed: false },
    { column: "impulse", name: "impulse", dashed: true }];
  const angular = [{ column: "angular_momentum", name: "about", dashed: false }];
  charts.add("momentum", { title: "Momentum, and impulse of external forces", unit: "N·s",
    series: components(history, linear, possible) });
  charts.add("momentum", { title: "Angular momentum about the origin", unit: "N·m·s",
    series: components(history, angular, possible * arm) });
}

function showMotion(charts, { block_rows: rows, blocks }) {
  const of = (column) => rows.blocks.map((block, i) =>
    ({ name: block.name, values: block[column], colour: i + 1, dashed: i >= 4 }));
  charts.add("motion", { title: "Speed of the centre of mass", unit: "m/s", time: rows.time,
    series: of("speed") });
  charts.add("motion", { title: "Contact force", unit: "N", time: rows.time, series: of("force") });
  const most = rows.blocks.length < blocks.length ? `The ${count(rows.blocks.length)} of ${
    counted(blocks.length, "block")} that had the most kinetic energy. ` : "";
  byId("motion-note").textContent = `${most}Contact forces are means since the previous row.`;
}

function showContacts(charts, { contacts, history }) {
  const live = { name: "", values: history.contacts, colour: 1 };
  const begun = { name: "", values: contacts.begun.number, colour: 1 };
  if (contacts.count > 0 || largest(history.contacts) > 0) {
    charts.add("contacts", { title: "Live contacts", unit: "", shape: "steps", series: [live] });
    const [first, second] = contacts.begun.time;
    const width = second === undefined ? "" : ` in each ${quantity(second - first, "s", 3)}`;
    charts.add("contacts", { title: `Contacts begun${width}`, unit: "", shape: "bars",
      time: contacts.begun.time, series: [begun] });
  }
  byId("contacts").hidden = false;
  byId("contacts-table").append(contacts.largest.length > 0 ? contactTable(contacts)
    : htmlElement("p", { class: "note" }, "No contact began."));
}

function contactTable({ count: all, largest: listed }) {
  const of = (column) => listed.map((contact) => contact[column]);
  const latest = largest(of("time_on"), of("time_off"));
  const numbers = [
    unitColumn("begins", "s", of("time_on"), latest),
    unitColumn("ends", "s", of("time_off"), latest),
    unitColumn("peak force", "N", of("peak_normal_force")),
    unitColumn("normal impulse", "N·s", of("normal_impulse")),
    unitColumn("slip", "m", of("slip")),
  ];
  const columns = [{ name: "main" }, { name: "target" }, { name: "type", kind: "word" },
    ...numbers.map(({ name }) => ({ name, kind: "number" }))];
  const rows = listed.map((contact, i) => {
    const texts = numbers.map((column) => column.texts[i]);
    if (contact.time_off === null) texts[1] = "lasts";
    return [contact.main, contact.target, contact.type, ...texts];
  });
  const which = listed.length < all ? `The ${listed.length} of ${counted(all, "contact")} with` :
    "Contacts by";
  return table(`${which} the largest peak of the normal force`, columns, rows);
}

function showRefinement(charts, history) {
  const changes = (values) => values?.some((value) => value !== values[0]);
  const one = (title, values) => ({ title, unit: "", shape: "steps",
    series: [{ name: "", values, colour: 1 }] });
  const { elements, refined_blocks: refined } = history;
  if (changes(elements)) charts.add("refinement", one("Elements", elements));
  if (changes(refined)) charts.add("refinement", one("Refined blocks", refined));
}

function showBlocks(blocks) {
  if (blocks.length === 0) return;
  const listed = blocks.slice(0, LISTED_BLOCKS);
  const columns = [{ name: "name" }, { name: "material" }, { name: "mass, kg", kind: "number" },
    { name: "fixed", kind: "word" }];
  const rows = listed.map(({ name, material, mass, fixed }) =>
    [name, material, significant(mass), fixed ? "fixed" : ""]);
  const more = blocks.length - listed.length;
  const caption = more > 0 ? `The first ${listed.length} blocks; there are ${count(more)} more`
    : counted(blocks.length, "block");
  byId("blocks-table").append(table(caption, columns, rows));
  byId("blocks").hidden = false;
}

function showReproduction({ version, summary, scene }) {
  byId("reproduce-note").textContent = `With cdem ${summary?.version ?? version}, in a folder ` +
    "with the scene below and its mesh files. The number of threads has no effect on results.";
  byId("commands").textContent = "cdem run scene.toml\ncdem report scene-results";
  byId("scene-text").textContent = scene;
  byId("scene-link").href = URL.createObjectURL(new Blob([scene], { type: "text/plain" }));
}

function showContents() {
  const sections = [...document.querySelectorAll("main > section")].filter((one) => !one.hidden);
  const links = sections.map((section) => {
    const text = section.querySelector("h2").textContent;
    return htmlElement("a", { href: `#${section.id}` }, text);
  });
  byId("contents").replaceChildren(...links);
}

// Everything but pictures and animation.
function showNumbers(data) {
  const charts = new Charts(data.history);
  showHead(data);
  showWarnings(data.summary?.warnings ?? []);
  showFacts(data);
  showEnergies(charts, data.history);
  showMomentum(charts, data);
  showMotion(charts, data);
  showContacts(charts, data);
  showRefinement(charts, data.history);
  showBlocks(data.blocks);
  showReproduction(data);
  charts.draw();
  root.dataset.charts = String(charts.all.length);
  return charts;
}

// The first frame, that of the impact, and the last.
function pictured(motion) {
  const last = motion.frames.length - 1;
  const named = [[0, "first frame"], [motion.impact, "first impact"], [last, "last frame"]];
  const captions = new Map();
  for (const [number, name] of named) {
    if (number === null) continue;
    captions.set(number, [...(captions.get(number) ?? []), name]);
  }
  return [...captions].map(([number, names]) => ({ number, name: names.join(", ") }));
}

// The animation with its controls, and the pictures.
class AnimationView {
  constructor(data, motion, charts) {
    Object.assign(this, { data, motion, charts });
    this.numbers = colourNumbers(data);
    this.fields = fieldsOf(motion, data.dimension);
    [this.field] = this.fields;
    const colours = blockColourTable(this.numbers);
    this.canvas = byId("canvas");
    this.renderer = new Renderer(this.canvas, motion, data.dimension, colours);
    this.camera = this.newCamera();
    this.player = new Player(motion.frames, () => this.onTime());
    byId("viewer").hidden = false;
    byId("stage").style.setProperty("--aspect", this.aspect());
  }

  newCamera() {
    const { extent } = this.renderer;
    return this.data.dimension === 2 ? new PlaneCamera(extent) : new OrbitCamera(extent);
  }

  // Width over height of pictures and stage.
  aspect() {
    return Math.min(2.8, Math.max(1.3, this.camera.shape()));
  }

  async showPictures() {
    const height = Math.round(960 / this.aspect());
    const size = { width: 960, height, density: 2.5 };
    const camera = this.newCamera();
    const images = pictured(this.motion).map(({ number, name }) => {
      const source = this.renderer.picture(number, camera, this.field, size);
      const time = `t = ${quantity(this.motion.frames[number].time, "s")}`;
      const image = htmlElement("img", { src: source, alt: `The blocks at ${time}`,
        width: size.width, height });
      const caption = htmlElement("figcaption", {}, htmlElement("b", {}, time), ` ${name}`);
      byId("pictures-row").append(htmlElement("figure", {}, image, caption));
      return image;
    });
    byId("pictures-key").append(colourKey(this.field, this.data.blocks, this.numbers));
    byId("pictures").hidden = false;
    await Promise.all(images.map((image) => image.decode()));
  }

  connect() {
    new CameraPointer(this.canvas, this.camera, () => this.requestDraw());
    new ResizeObserver(() => this.requestDraw()).observe(this.canvas);
    this.canvas.addEventListener("webglcontextlost", () => sayNoAnimation(
      "The browser has lost the animation. Load the page again to see it."));
    document.addEventListener("keydown", (event) => this.onKey(event));
    this.charts.seek = (time) => this.player.seek(time);
    this.connectControls();
    this.describe();
    this.onTime();
  }

  connectControls() {
    const { player } = this;
    const scrub = byId("scrub");
    [scrub.min, scrub.max] = [player.start, player.end];
    scrub.addEventListener("input", () => {
      // Pausing puts the slider where the animation is.
      const time = Number(scrub.value);
      player.pause();
      player.seek(time);
    });
    byId("play-button").addEventListener("click", () => player.toggle());
    byId("previous-frame").addEventListener("click", () => player.step(-1));
    byId("next-frame").addEventListener("click", () => player.step(1));
    byId("reset-view").addEventListener("click", () => this.moveCamera("reset"));
    byId("element-edges").addEventListener("change", () => this.requestDraw());
    this.connectChoice("duration", this.durations(), player.duration, (seconds) => {
      player.duration = seconds;
    });
    const fields = this.fields.map((field) => [field.label, field]);
    this.connectChoice("colouring", fields, this.field, (field) => this.colourBy(field));
  }

  // Fills a list of choices, [text, value] each.
  connectChoice(id, choices, chosen, choose) {
    const list = byId(id);
    list.append(...choices.map(([text]) => htmlElement("option", {}, text)));
    list.selectedIndex = choices.findIndex(([, value]) => value === chosen);
    list.addEventListener("change", () => choose(choices[list.selectedIndex][1]));
    choose(chosen);
  }

  durations() {
    const real = this.player.end - this.player.start;
    const times = [2, 4, 8, 16, 32, 64].map((seconds) => [`${seconds} s`, seconds]);
    if (real >= 0.5 && real <= 600) times.push([`real time, ${quantity(real, "s", 3)}`, real]);
    return times;
  }

  colourBy(field) {
    this.field = field;
    byId("viewer-key").replaceChildren(colourKey(field, this.data.blocks, this.numbers));
    this.requestDraw();
  }

  describe() {
    const drag = this.data.dimension === 2 ? "Drag to move" :
      "Drag to turn, with Shift or the right button to move";
    const { left_out: left } = this.motion;
    const missing = left > 0 ? ` ${counted(left, "frame")} left out here to keep the page small; ` +
      "the results have all of them, for ParaView." : "";
    byId("viewer-help").textContent = `${drag}; the wheel zooms, a double click resets. ` +
      "Space plays, ← and → step through frames; Shift and an arrow act like a drag; " +
      `+ and − zoom. A click on a chart goes to its time.${missing}`;
    this.canvas.setAttribute("aria-label", `Animation of ${this.data.title || "the blocks"}`);
  }

  moveCamera(how, ...amounts) {
    this.camera[how](...amounts, this.canvas.width / this.canvas.height);
    this.requestDraw();
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.isInView()) return;
    // The element with the focus may need the key.
    const wanting = event.key === " " ? "button, select, input, summary, a"
      : "select, input:not(#scrub), pre, .scroll";
    if (event.target.closest?.(wanting)) return;
    const action = this.actions(event.shiftKey)[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // Actions of keys; many keyboards have + only with Shift.
  actions(shifted) {
    const step = (direction) => () => this.player.step(direction);
    const turn = (dx, dy) => () => this.moveCamera("turn", dx, dy);
    const zoom = (factor) => () => this.moveCamera("zoom", factor, 0, 0);
    const moves = { ArrowLeft: turn(-0.05, 0), ArrowRight: turn(0.05, 0), ArrowUp: turn(0, -0.05),
      ArrowDown: turn(0, 0.05) };
    const steps = { ArrowLeft: step(-1), ArrowRight: step(1), " ": () => this.player.toggle() };
    const zooms = { "+": zoom(1.25), "-": zoom(0.8), 0: () => this.moveCamera("reset") };
    return { ...zooms, ...(shifted ? moves : steps) };
  }

  // Keys scroll as usual where the animation is not to be seen.
  isInView() {
    const box = byId("viewer").getBoundingClientRect();
    return box.bottom > 0 && box.top < window.innerHeight;
  }

  onTime() {
    const { player } = this;
    const frame = player.frame();
    const text = `t = ${quantity(player.time, "s")}`;
    const which = `frame ${frame + 1} of ${player.times.length}`;
    byId("moment").replaceChildren(htmlElement("b", {}, text), ` ${which}`);
    byId("scrub").value = player.time;
    byId("scrub").setAttribute("aria-valuetext", `${text}, ${which}`);
    byId("play-button").textContent = player.playing ? "Pause" : "Play";
    this.charts.setCursor(player.time);
    this.requestDraw();
  }

  // However much changes, it is drawn once for each picture on the screen.
  requestDraw() {
    this.requested ??= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.requested = null;
    this.renderer.resize(window.devicePixelRatio || 1);
    const withEdges = byId("element-edges").checked;
    this.renderer.draw(this.player.moment(), this.camera, this.field, withEdges);
    root.dataset.frames = String(this.renderer.drawn);
    if (this.data.dimension === 2) this.drawScaleBar();
    else this.drawTriad();
  }

  // A length of 1, 2 or 5 times a power of ten that takes about a sixth of the width.
  drawScaleBar() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const metre = height / this.camera.height(width / height);
    const length = ticksAround(0, width / 6 / metre, 1)[1];
    const bar = byId("scale-bar");
    bar.style.width = `${length * metre}px`;
    bar.textContent = quantity(length, "m");
    bar.hidden = false;
  }

  drawTriad() {
    const { right, up, back } = this.camera.axes;
    const axes = ["x", "y", "z"].map((name, i) => ({ name, x: right[i], y: -up[i], to: back[i] }));
    axes.sort((a, b) => a.to - b.to);
    const marks = axes.flatMap(({ name, x, y }) => [
      svgElement("line", { class: name, x2: 24 * x, y2: 24 * y }),
      svgElement("text", { x: 32 * x, y: 32 * y, dy: "0.35em", "text-anchor": "middle" }, name),
    ]);
    byId("triad").replaceChildren(...marks);
    byId("triad").removeAttribute("hidden");
  }
}

function sayNoAnimation(why) {
  byId("no-animation").textContent = why;
  byId("no-animation").hidden = false;
  byId("viewer").hidden = true;
}

async function showAnimation(data, charts) {
  if (!data.motion) return sayNoAnimation("The results have no frames.");
  if (!("DecompressionStream" in window)) throw new MissingPart("DecompressionStream");
  const working = (share) => sayNoAnimation(`Unpacking frames: ${Math.floor(100 * share)} %`);
  const motion = await decodeMotion(data.motion, working);
  const animation = new AnimationView(data, motion, charts);
  byId("no-animation").hidden = true;
  const pictures = animation.showPictures();
  animation.connect();
  animation.draw();
  await pictures;
  if (location.hash !== "#play") return;
  byId("animation").scrollIntoView();
  animation.player.play();
}

async function showPage() {
  const data = JSON.parse(byId("data").textContent);
  const charts = showNumbers(data);
  showContents();
  try {
    await showAnimation(data, charts);
  } catch (error) {
    if (!(error instanceof MissingPart)) {
      sayNoAnimation("Pictures and animation are not possible here.");
      throw error;
    }
    sayNoAnimation(`Pictures and animation need ${error.message}, which this browser does not ` +
      "have. The rest of this page is complete.");
  }
  showContents();
}

function start() {
  countErrors();
  [root.dataset.frames, root.dataset.charts] = ["0", "0"];
  const toggleTheme = followTheme();
  document.addEventListener("DOMContentLoaded", async () => {
    connectThemeButton(toggleTheme);
    try {
      await showPage();
      root.dataset.state = "ready";
    } catch (error) {
      root.dataset.state = `failed: ${error.message}`;
      byId("failure").textContent = `Parts of this page are missing: ${error.message}`;
      byId("failure").hidden = false;
    }
  });
}

start();
