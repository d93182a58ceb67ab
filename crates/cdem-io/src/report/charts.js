// Numbers for people: as text, in tables, and in charts over time.

const PREFIXES = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"];
const THIN_SPACE = "\u202f";
const NOTHING = "–";

// The SI prefix in which a number of that size has one to three digits before the point.
function prefixOf(size) {
  if (!(size > 0) || !Number.isFinite(size)) return { factor: 1, symbol: "" };
  const power = Math.min(5, Math.max(-5, Math.floor(Math.log10(size) / 3 + 1e-12)));
  return { factor: 1000 ** power, symbol: PREFIXES[power + 5] };
}

// The prefix of an axis; shares and counts have none.
function prefixFor(unit, size) {
  return unit === "" || unit === "%" ? { factor: 1, symbol: "" } : prefixOf(size);
}

// With at most so many significant digits: "1.235", "−0.02", "32 400".
function significant(value, digits = 4) {
  if (value === null || !Number.isFinite(value)) return NOTHING;
  const rounded = Number(value.toPrecision(digits));
  if (Number.isInteger(rounded) && Math.abs(rounded) >= 1e4) return count(rounded);
  return String(rounded).replaceAll("-", "−");
}

// "74.8 kJ"
function quantity(value, unit, digits = 4) {
  if (value === null || !Number.isFinite(value)) return NOTHING;
  const { factor, symbol } = prefixOf(Math.abs(value));
  return `${significant(value / factor, digits)} ${symbol}${unit}`;
}

// A duration with as much detail as it deserves.
function duration(seconds) {
  const pad = (number) => String(Math.floor(number)).padStart(2, "0");
  if (seconds < 60) return quantity(seconds, "s");
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ${pad(seconds % 60)} s`;
  return `${Math.floor(seconds / 3600)} h ${pad((seconds % 3600) / 60)} min`;
}

// "12 345"
function count(value) {
  const digits = String(Math.round(value)).replace("-", "−");
  return digits.replace(/\B(?=(\d{3})+$)/g, THIN_SPACE);
}

// "1 block", "2 000 blocks"
function counted(value, thing) {
  return `${count(value)} ${thing}${value === 1 ? "" : "s"}`;
}

// A share of a whole in per cent; what is too small to matter is told as such.
function percent(part, whole) {
  const share = part === null ? NaN : part / whole;
  if (!Number.isFinite(share)) return NOTHING;
  if (share !== 0 && Math.abs(share) < 1e-5) return "< 0.001 %";
  return `${significant(100 * share, 3)} %`;
}

// A value as an axis or a readout in one unit shows it.
function inUnit(value, unit) {
  if (!Number.isFinite(value)) return NOTHING;
  if (unit === "") return Number.isInteger(value) ? count(value) : significant(value);
  return unit === "%" ? `${significant(value, 3)} %` : quantity(value, unit);
}

// Largest size of the values of columns.
function largest(...columns) {
  let most = 0;
  for (const column of columns) {
    for (const value of column ?? []) if (Math.abs(value) > most) most = Math.abs(value);
  }
  return most;
}

// Multiples of 1, 2 or 5 times a power of ten, from below `low` to above `high`.
function ticksAround(low, high, about, least = 0) {
  const rough = Math.max((high - low) / about, Number.MIN_VALUE);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = Math.max(least, power * [1, 2, 5, 10].find((m) => m * power >= rough * 0.999));
  const first = Math.floor(low / step + 1e-9);
  const last = Math.ceil(high / step - 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}

const SVG = "http://www.w3.org/2000/svg";

function svgElement(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

// An element of HTML; children are elements or plain text.
function htmlElement(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// A table in a frame that scrolls. Columns are {name, kind}, the kind being nothing, "number" or
// "word" for what is not to be broken.
function table(caption, columns, rows) {
  const kind = (column) => ({ class: columns[column].kind ?? "" });
  const head = columns.map(({ name }, i) => htmlElement("th", { scope: "col", ...kind(i) }, name));
  const body = rows.map((row) => {
    const cells = row.map((text, i) => htmlElement("td", kind(i), text));
    return htmlElement("tr", {}, ...cells);
  });
  const whole = htmlElement("table", {},
    htmlElement("caption", {}, caption),
    htmlElement("thead", {}, htmlElement("tr", {}, ...head)),
    htmlElement("tbody", {}, ...body));
  const name = { role: "region", tabindex: "0", "aria-label": caption };
  return htmlElement("div", { class: "scroll", ...name }, whole);
}

// A column of numbers with the prefix that suits a number of some size: {name, texts}.
function unitColumn(name, unit, values, size = largest(values)) {
  const prefix = prefixFor(unit, size);
  const texts = values.map((value) => significant(value === null ? null : value / prefix.factor));
  return { name: `${name}, ${prefix.symbol}${unit}`, texts };
}

// The index at which a sorted array comes nearest to a value.
function nearest(sorted, value) {
  let [low, high] = [0, sorted.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle;
    else high = middle;
  }
  return value - sorted[low] < sorted[high] - value ? low : high;
}

// Pixels of a drawing, and around the plot in it.
const PLOT = { height: 252, right: 16, bottom: 42 };

// Curves over time: axes, a legend that hides and shows them, a crosshair with a readout, and a
// cursor where the animation is.
class Chart {
  // `time` holds the instants, s, `span` the first and last of the axis, and `series` the
  // curves: {name, values, colour (1 to 8), dashed}; one that needs no name has "". `shape` is
  // "line", "steps" (a value holds until the next) or "bars". `seek` is called with the instant
  // that is clicked.
  constructor({ title, unit, time, span, series, shape = "line", seek = () => {} }) {
    Object.assign(this, { title, unit, time, span, series, shape, seek });
    // Room for the unit.
    this.top = unit === "" ? 10 : 26;
    this.hidden = new Set();
    this.cursorTime = null;
    this.index = null;
    this.svg = svgElement("svg", { class: "drawing", role: "img", tabindex: "0" });
    this.readout = htmlElement("div", { class: "readout", role: "status", hidden: "" });
    this.plot = htmlElement("div", { class: "plot" }, this.svg, this.readout);
    const caption = htmlElement("figcaption", {}, title);
    this.figure = htmlElement("figure", { class: "chart" }, caption, this.legend(), this.plot);
    this.listen();
  }

  legend() {
    const legend = htmlElement("div", { class: "legend" });
    for (const series of this.series) {
      if (!series.name) continue;
      const label = htmlElement("span", {}, series.name);
      const button = htmlElement("button", { type: "button", "aria-pressed": "true" });
      button.append(swatch(series), label);
      button.addEventListener("click", () => this.toggle(series, button));
      legend.append(button);
    }
    return legend;
  }

  toggle(series, button) {
    if (!this.hidden.delete(series)) this.hidden.add(series);
    button.setAttribute("aria-pressed", String(!this.hidden.has(series)));
    this.draw();
  }

  get shown() {
    return this.series.filter((series) => !this.hidden.has(series));
  }

  // Draws the chart as wide as its place is.
  draw() {
    this.width = Math.max(280, this.plot.clientWidth);
    this.measure();
    this.svg.replaceChildren();
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${PLOT.height}`);
    this.svg.setAttribute("aria-label", this.description());
    this.drawValueAxis();
    this.drawTimeAxis();
    for (const series of this.shown) this.drawSeries(series);
    this.cursor = this.verticalLine("cursor");
    this.crosshair = this.verticalLine("crosshair");
    this.setCursor(this.cursorTime);
    this.look(null);
  }

  // Finds the range of values, with zero in it, and the room that their labels take.
  measure() {
    let [low, high] = [0, 0];
    for (const series of this.shown) {
      for (const value of series.values) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (low === high) high = 1;
    this.ticks = ticksAround(low, high, 5, this.unit === "" ? 1 : 0);
    [this.low, this.high] = [this.ticks[0], this.ticks.at(-1)];
    this.prefix = prefixFor(this.unit, Math.max(-this.low, this.high));
    const longest = Math.max(...this.ticks.map((tick) => this.tickText(tick).length));
    this.left = 14 + 7 * longest;
  }

  tickText(value) {
    if (this.unit === "") return count(value);
    return significant(value / this.prefix.factor);
  }

  description() {
    const names = this.shown.map((series) => series.name).join(", ");
    const which = names ? `: ${names}` : "";
    const ends = this.span.map((time) => quantity(time, "s")).join(" to ");
    return `${this.title} over time, ${ends}${which}. Arrow keys read values.`;
  }

  x(time) {
    const [first, last] = this.span;
    const share = last > first ? (time - first) / (last - first) : 0;
    return this.left + share * (this.width - this.left - PLOT.right);
  }

  y(value) {
    const share = (value - this.low) / (this.high - this.low);
    return PLOT.height - PLOT.bottom - share * (PLOT.height - this.top - PLOT.bottom);
  }

  drawValueAxis() {
    const right = this.width - PLOT.right;
    for (const tick of this.ticks) {
      const y = this.y(tick).toFixed(1);
      const kind = tick === 0 ? "grid zero" : "grid";
      this.svg.append(svgElement("line", { class: kind, x1: this.left, x2: right, y1: y, y2: y }));
      const place = { class: "tick", x: this.left - 7, y, dy: "0.35em", "text-anchor": "end" };
      this.svg.append(svgElement("text", place, this.tickText(tick)));
    }
    const unit = this.prefix.symbol + this.unit;
    this.svg.append(svgElement("text", { class: "unit", x: 0, y: 11 }, unit));
  }

  drawTimeAxis() {
    const [first, last] = this.span;
    const prefix = prefixOf(Math.max(Math.abs(first), Math.abs(last)));
    const bottom = PLOT.height - PLOT.bottom;
    const about = Math.max(3, Math.min(8, this.width / 75));
    const edge = 1e-6 * (last - first);
    for (const tick of ticksAround(first, last, about)) {
      if (tick < first - edge || tick > last + edge) continue;
      const x = this.x(tick).toFixed(1);
      this.svg.append(
        svgElement("line", { class: "notch", x1: x, x2: x, y1: bottom, y2: bottom + 4 }),
        svgElement("text", { class: "tick", x, y: bottom + 18, "text-anchor": "middle" },
          significant(tick / prefix.factor)),
      );
    }
    const x = this.width - PLOT.right;
    const place = { class: "unit", x, y: PLOT.height - 4, "text-anchor": "end" };
    this.svg.append(svgElement("text", place, `time, ${prefix.symbol}s`));
  }

  drawSeries(series) {
    const kind = `curve ${this.shape}${series.dashed ? " dashed" : ""}`;
    // One of the three methods below.
    const path = svgElement("path", { class: kind, d: this[this.shape](series) });
    path.style.setProperty("--colour", `var(--series-${series.colour})`);
    this.svg.append(path);
  }

  line({ values }) {
    let path = "";
    let pen = "M";
    for (let i = 0; i < this.time.length; i++) {
      if (!Number.isFinite(values[i])) {
        pen = "M";
        continue;
      }
      path += `${pen}${this.x(this.time[i]).toFixed(1)} ${this.y(values[i]).toFixed(1)}`;
      pen = "L";
    }
    return path;
  }

  steps({ values }) {
    let path = "";
    for (let i = 0; i < this.time.length; i++) {
      const [x, y] = [this.x(this.time[i]).toFixed(1), this.y(values[i] || 0).toFixed(1)];
      path += i === 0 ? `M${x} ${y}` : `H${x}V${y}`;
    }
    return path;
  }

  bars({ values }) {
    const apart = this.time.length > 1 ? this.time[1] - this.time[0] : this.span[1] - this.span[0];
    const zero = this.y(0).toFixed(1);
    let path = "";
    for (let i = 0; i < this.time.length; i++) {
      if (!values[i]) continue;
      const [left, right] = [-0.5, 0.5].map((side) => this.x(this.time[i] + side * apart));
      const gap = Math.min(0.5, (right - left) / 8);
      path += `M${(left + gap).toFixed(1)} ${zero}V${this.y(values[i]).toFixed(1)}`;
      path += `H${(right - gap).toFixed(1)}V${zero}Z`;
    }
    return path;
  }

  verticalLine(kind) {
    const ends = { y1: this.top - 4, y2: PLOT.height - PLOT.bottom };
    const line = svgElement("line", { class: kind, visibility: "hidden", ...ends });
    this.svg.append(line);
    return line;
  }

  // Puts the cursor where the animation is; `null` takes it away.
  setCursor(time) {
    this.cursorTime = time;
    if (this.cursor) this.moveLine(this.cursor, time);
  }

  moveLine(line, time) {
    const inside = time !== null && time >= this.span[0] && time <= this.span[1];
    line.setAttribute("visibility", inside ? "visible" : "hidden");
    if (!inside) return;
    line.setAttribute("x1", this.x(time).toFixed(1));
    line.setAttribute("x2", this.x(time).toFixed(1));
  }

  // Shows what the curves are at an instant of the table; `null` ends that.
  look(index) {
    this.index = index;
    this.svg.querySelectorAll(".spot").forEach((spot) => spot.remove());
    this.readout.hidden = index === null;
    this.moveLine(this.crosshair, index === null ? null : this.time[index]);
    if (index === null) return;
    const rows = [htmlElement("b", {}, `t = ${quantity(this.time[index], "s")}`)];
    for (const series of this.shown) {
      const value = htmlElement("span", {}, inUnit(series.values[index], this.unit));
      const name = htmlElement("span", { class: "name" }, series.name);
      rows.push(htmlElement("div", {}, swatch(series), name, value));
      this.spot(series, index);
    }
    this.readout.replaceChildren(...rows);
    this.placeReadout(this.x(this.time[index]));
  }

  spot(series, index) {
    if (!Number.isFinite(series.values[index])) return;
    const place = { cx: this.x(this.time[index]), cy: this.y(series.values[index]), r: 3.5 };
    const spot = svgElement("circle", { class: "spot", ...place });
    spot.style.setProperty("--colour", `var(--series-${series.colour})`);
    this.svg.append(spot);
  }

  // Beside the crosshair, on the side that has room.
  placeReadout(x) {
    const onTheLeft = x > this.width / 2;
    this.readout.style.left = onTheLeft ? "auto" : `${x + 12}px`;
    this.readout.style.right = onTheLeft ? `${this.width - x + 12}px` : "auto";
  }

  // The instant of the table that is nearest to the pointer.
  under(event) {
    const box = this.svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.width;
    const share = (x - this.left) / (this.width - this.left - PLOT.right);
    return nearest(this.time, this.span[0] + share * (this.span[1] - this.span[0]));
  }

  listen() {
    this.svg.addEventListener("pointermove", (event) => this.look(this.under(event)));
    this.svg.addEventListener("pointerleave", () => this.look(null));
    this.svg.addEventListener("blur", () => this.look(null));
    this.svg.addEventListener("click", (event) => this.seek(this.time[this.under(event)]));
    this.svg.addEventListener("keydown", (event) => this.onKey(event));
    // Drawing changes sizes, which must wait until they have all been told.
    new ResizeObserver(() => requestAnimationFrame(() => {
      if (Math.abs(this.plot.clientWidth - this.width) > 1) this.draw();
    })).observe(this.plot);
  }

  onKey(event) {
    const last = this.time.length - 1;
    const stride = event.shiftKey ? Math.max(1, Math.round(last / 50)) : 1;
    const moves = { ArrowLeft: -stride, ArrowRight: stride, Home: -last, End: last };
    if (event.key in moves) {
      const from = this.index ?? nearest(this.time, this.cursorTime ?? this.span[0]);
      this.look(Math.min(last, Math.max(0, from + moves[event.key])));
    } else if (event.key === "Enter" && this.index !== null) {
      this.seek(this.time[this.index]);
    } else if (event.key === "Escape") {
      this.look(null);
    } else {
      return;
    }
    // The animation listens to the same keys.
    event.preventDefault();
    event.stopPropagation();
  }
}

// A short line in the colour of a curve.
function swatch(series) {
  const line = htmlElement("i", { class: series.dashed ? "swatch dashed" : "swatch" });
  line.style.setProperty("--colour", `var(--series-${series.colour})`);
  return line;
}

// Charts of one page: they share the axis of time and the cursor.
class Charts {
  constructor(history) {
    const time = history.time ?? [];
    this.time = time;
    this.span = [time[0] ?? 0, time.at(-1) ?? 0];
    this.all = [];
    this.seek = () => {};
  }

  // Adds a chart to a section; series without values are left out.
  add(section, options) {
    const series = options.series.filter(({ values }) => values?.length > 0);
    if (series.length === 0) return;
    const place = byId(`${section}-charts`);
    const defaults = { time: this.time, span: this.span, seek: (time) => this.seek(time) };
    const chart = new Chart({ ...defaults, ...options, series });
    byId(section).hidden = false;
    place.append(chart.figure);
    this.all.push(chart);
  }

  // When all are in their places, which depend on each other.
  draw() {
    for (const chart of this.all) chart.draw();
  }

  setCursor(time) {
    for (const chart of this.all) chart.setCursor(time);
  }
}
