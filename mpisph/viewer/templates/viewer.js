"use strict";
(() => {
  const LEVELS = 65534;
  const NO_VALUE = 65535;
  // Takes r to -r.
  const MIRROR = [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const GREY = [140, 140, 140];
  const SPEEDS = [2, 5, 10, 30];
  // A disc around the square that is a particle's section.
  const DISC = Math.SQRT1_2;

  // ---- what lies within the page, or comes from the program that serves it

  function bytesOf(text) {
    const letters = atob(text.trim());
    const bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
    return bytes;
  }

  async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Undoes `packing.pack`: the low bytes of all steps of a column, then the high ones.
  function unpack(bytes, count) {
    const columns = [];
    for (let first = 0; first < bytes.length; first += 2 * count) {
      const column = new Uint16Array(count);
      let code = 0;
      for (let i = 0; i < count; i++) {
        code = (code + bytes[first + i] + (bytes[first + count + i] << 8)) & 0xffff;
        column[i] = code;
      }
      columns.push(column);
    }
    return columns;
  }

  function restored(codes, [low, high]) {
    const step = (high - low) / LEVELS;
    const values = new Float32Array(codes.length);
    for (let i = 0; i < codes.length; i++) values[i] = low + step * codes[i];
    return values;
  }

  class Run {
    constructor(description) {
      this.known = new Map();
      this.describe(description);
    }

    describe(description) {
      this.about = description;
      this.fields = description.fields.map((field) => ({ ...field, shades: shadesOf(field.colours) }));
      for (const [name, names] of [["body", description.bodies.map((b) => b.name)], ["material", description.materials]]) {
        this.fields.push({ name, label: name, unit: "", names });
      }
    }

    async setFixed(bytes) {
      const count = this.about.particles;
      const [body, material, ring, low, high] = unpack(await inflate(bytes), count);
      this.body = body;
      this.material = material;
      this.ring = restored(ring, this.about.fixed.ring);
      // A ring drawn to the axis becomes a ball, no larger.
      this.nearest = this.ring.map((ring) => 0.5 * Math.cbrt(2 * ring));
      this.ids = Uint32Array.from(low, (half, i) => half + 65536 * high[i]);
    }

    async addFrame(key, bytes) {
      this.known.set(key, unpack(await inflate(bytes), this.about.particles));
    }

    get times() {
      return this.about.frames.map((frame) => frame.time);
    }

    // The last frame up to a time, or the first one.
    frameAt(time) {
      let found = 0;
      this.times.forEach((t, k) => { if (t <= time * (1 + 1e-9) + 1e-12) found = k; });
      return found;
    }

    columns(frame) {
      return this.known.get(this.about.frames[frame].key);
    }

    has(name) {
      return this.fields.some((field) => field.name === name);
    }

    // By body where the run has no such field.
    field(name) {
      return this.fields.find((field) => field.name === name) || this.fields.find((field) => field.name === "body");
    }

    // Index of the column of a field with a scale.
    column(name) {
      return 2 + this.about.fields.findIndex((field) => field.name === name);
    }

    value(frame, column, particle) {
      const code = this.columns(frame)[column][particle];
      if (code === NO_VALUE) return null;
      const [low, high] = this.about.frames[frame].ranges[column];
      return low + ((high - low) / LEVELS) * code;
    }
  }

  function shadesOf(text) {
    const shades = [];
    for (let i = 0; i < text.length; i += 6) {
      shades.push([0, 2, 4].map((k) => parseInt(text.slice(i + k, i + k + 2), 16)));
    }
    return shades;
  }

  function rgb(hex) {
    return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  }

  // ---- small things

  function make(tag, kind, text) {
    const element = document.createElement(tag);
    if (kind) element.className = kind;
    if (text !== undefined) element.textContent = text;
    return element;
  }

  function shortNumber(x) {
    if (x === null || !Number.isFinite(x)) return "–";
    if (x === 0) return "0";
    const size = Math.abs(x);
    const text = size >= 1e5 || size < 1e-4 ? x.toExponential(3) : String(Number(x.toPrecision(4)));
    return text.replace("-", "−");
  }

  function niceStep(span, most) {
    const rough = span / most;
    const power = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((k) => k * power).find((step) => step >= rough);
  }

  function withUnit(field) {
    return field.unit ? `${field.label} [${field.unit}]` : field.label;
  }

  function chooser(label, options, value, change) {
    const box = make("label", "", `${label} `);
    const select = make("select");
    select.setAttribute("aria-label", label);
    for (const [key, text] of options) {
      const option = make("option", "", text);
      option.value = key;
      select.append(option);
    }
    select.value = value;
    select.addEventListener("change", () => change(select.value));
    box.append(select);
    return [box, select];
  }

  // ---- particles as points: a point is one vertex, and any renderer is fast with it

  const VERTEX = `#version 300 es
    in vec3 positions;
    in vec3 positions64Low;
    in float radii;
    in vec4 colors;
    out vec4 colour;
    out float across;
    const float LEAST = 1.4;
    void main() {
      int index = gl_VertexID + 1;
      geometry.worldPosition = positions;
      geometry.pickingColor = vec3(index & 255, (index >> 8) & 255, (index >> 16) & 255);
      gl_Position = project_position_to_clipspace(positions, positions64Low, vec3(0.0), geometry.position);
      DECKGL_FILTER_GL_POSITION(gl_Position, geometry);
      across = max(2.0 * radii * project.scale, LEAST) * project.devicePixelRatio;
      gl_PointSize = across;
      colour = vec4(colors.rgb, 1.0);
      DECKGL_FILTER_COLOR(colour, geometry);
    }`;

  // Few pixels are a square; more are a disc.
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec4 colour;
    in float across;
    out vec4 fragColor;
    void main() {
      vec2 place = 2.0 * gl_PointCoord - 1.0;
      if (across > 4.0 && dot(place, place) > 1.0) discard;
      fragColor = colour;
      DECKGL_FILTER_COLOR(fragColor, geometry);
    }`;

  function particleLayer() {
    const { deck, luma } = window;
    class ParticleLayer extends deck.Layer {
      getShaders() {
        return super.getShaders({ vs: VERTEX, fs: FRAGMENT, modules: [deck.project32, deck.picking] });
      }

      initializeState() {
        const manager = this.getAttributeManager();
        manager.remove(["instancePickingColors"]);
        manager.add({
          positions: { size: 3, type: "float64", fp64: this.use64bitPositions(), accessor: "getPosition" },
          radii: { size: 1, accessor: "getRadius" },
          colors: { size: 4, type: "unorm8", accessor: "getFillColor" },
        });
        this.state.model = new luma.Model(this.context.device, {
          ...this.getShaders(),
          id: this.props.id,
          bufferLayout: manager.getBufferLayouts(),
          topology: "point-list",
          isInstanced: false,
        });
      }

      draw() {
        this.state.model.setVertexCount(this.props.data.length);
        this.state.model.draw(this.context.renderPass);
      }
    }
    ParticleLayer.layerName = "ParticleLayer";
    ParticleLayer.defaultProps = {
      getPosition: { type: "accessor", value: [0, 0, 0] },
      getRadius: { type: "accessor", value: 1 },
      getFillColor: { type: "accessor", value: [0, 0, 0, 255] },
    };
    return ParticleLayer;
  }

  // ---- one run in a stage of its own

  class Panel {
    constructor(viewer, run) {
      this.viewer = viewer;
      this.run = run;
      this.frame = 0;
      this.root = make("section", "viewer-panel");
      this.head = make("h2");
      this.when = make("span");
      this.head.append(make("bdi", "", viewer.runs.length > 1 ? `${run.about.name} ` : ""), this.when);
      this.stage = make("div", "viewer-stage");
      this.stage.tabIndex = 0;
      this.stage.setAttribute("role", "application");
      this.stage.setAttribute("aria-label", `particles of ${run.about.title}`);
      this.marks = make("canvas", "viewer-marks");
      this.tip = make("div", "viewer-tip");
      this.tip.hidden = true;
      this.key = make("div", "viewer-key");
      this.root.append(this.head);
      if (viewer.runs.length > 1) this.root.append(make("p", "viewer-note", run.about.title));
      this.root.append(this.stage, this.key);
      if (run.about.note) this.root.append(make("p", "viewer-note", `${run.about.note}.`));
      viewer.panels.append(this.root);
      this.hovered = null;
    }

    start() {
      const { deck } = window;
      this.fitStage();
      this.view = this.fitted(this.whole());
      this.deck = new deck.Deck({
        parent: this.stage,
        views: this.plane(!this.viewer.within),
        viewState: { rz: this.view },
        pickingRadius: 5,
        layers: [],
        onViewStateChange: ({ viewState }) => this.viewer.move(this, viewState),
        onHover: (info) => this.point(info),
        onClick: (info) => this.point(info),
        // The stage is what the Tab key comes to.
        onLoad: () => { this.stage.querySelector("canvas").tabIndex = -1; },
        onError: (error) => console.error(error),
      });
      this.stage.append(this.marks, this.tip);
      // Within a page the wheel turns its leaves until someone is at work here.
      this.stage.addEventListener("focusin", () => this.setWheel(true));
      this.stage.addEventListener("focusout", () => this.setWheel(!this.viewer.within));
      this.stage.addEventListener("pointerleave", () => { this.tip.hidden = true; });
      this.stage.addEventListener("dblclick", () => this.viewer.fit());
      new ResizeObserver(() => this.resized()).observe(this.stage);
    }

    // The r-z plane; the wheel may zoom in it or not.
    plane(wheel) {
      const controller = { scrollZoom: wheel, doubleClickZoom: false, keyboard: false };
      return new window.deck.OrthographicView({ id: "rz", flipY: false, controller });
    }

    setWheel(on) {
      this.deck.setProps({ views: this.plane(on) });
    }

    whole() {
      return this.viewer.linked ? this.viewer.union : this.run.about.view;
    }

    fitStage() {
      const view = this.whole();
      const width = this.root.clientWidth;
      const height = (width * 2 * view.r_high) / (view.z_high - view.z_low);
      const most = Math.max(220, 0.66 * window.innerHeight);
      this.stage.style.height = `${Math.round(Math.min(Math.max(height, 200), most))}px`;
    }

    fitted({ z_low, z_high, r_low, r_high }) {
      const below = r_low === undefined ? -r_high : r_low;
      const scale = Math.min(
        this.stage.clientWidth / (z_high - z_low),
        this.stage.clientHeight / (r_high - below),
      );
      return {
        target: [(z_low + z_high) / 2, (r_high + below) / 2, 0],
        zoom: Math.log2(scale),
        minZoom: Math.log2(scale) - 4,
        maxZoom: Math.log2(scale) + 10,
      };
    }

    resized() {
      const width = this.stage.clientWidth;
      if (!width || (width === this.width && this.stage.clientHeight === this.height)) return;
      const before = this.width;
      this.fitStage();
      this.width = width;
      this.height = this.stage.clientHeight;
      if (this.untouched || before === undefined) this.setView(this.fitted(this.whole()), true);
      else this.drawMarks();
    }

    setView(view, untouched = false) {
      this.view = { ...this.view, ...view };
      this.untouched = untouched;
      this.deck.setProps({ viewState: { rz: this.view } });
      this.drawMarks();
    }

    show(frame) {
      this.frame = frame;
      this.draw();
    }

    draw() {
      const columns = this.run.columns(this.frame);
      if (!columns) return;
      const frame = this.run.about.frames[this.frame];
      const lacks = [...new Set([this.viewer.above, this.viewer.below])].filter((name) => !this.run.has(name));
      const without = lacks.length ? `; no ${lacks.join(", no ")}: coloured by body` : "";
      this.when.textContent = `t = ${shortNumber(frame.time)} µs ${this.run.about.origin}${without}`;
      const order = this.viewer.visible(this.run);
      const count = order.length;
      const places = new Float32Array(2 * count);
      const sizes = new Float32Array(count);
      const [[zLow, zHigh], [rLow, rHigh]] = frame.ranges;
      const [zStep, rStep] = [(zHigh - zLow) / LEVELS, (rHigh - rLow) / LEVELS];
      const [z, r] = columns;
      const { ring, nearest } = this.run;
      for (let k = 0; k < count; k++) {
        const i = order[k];
        const radius = rLow + rStep * r[i];
        // Of a run that broke down, some particles lie nowhere.
        places[2 * k] = z[i] === NO_VALUE || r[i] === NO_VALUE ? 1e9 : zLow + zStep * z[i];
        places[2 * k + 1] = radius;
        sizes[k] = DISC * Math.sqrt(ring[i] / Math.max(radius, nearest[i]));
      }
      this.order = order;
      this.shown = [this.viewer.above, this.viewer.below].map((name) => this.run.field(name));
      const colours = this.shown.map((field) => this.colours(field, columns, order));
      const layers = colours.map((colour, half) => new this.viewer.Layer({
        id: half ? "below" : "above",
        data: {
          length: count,
          attributes: {
            getPosition: { value: places, size: 2 },
            getRadius: { value: sizes, size: 1 },
            getFillColor: { value: colour, size: 4, normalized: true },
          },
        },
        modelMatrix: half ? MIRROR : null,
        pickable: true,
      }));
      this.deck.setProps({ layers });
      this.drawMarks();
      this.drawKey();
      if (this.hovered) this.point(this.hovered);
    }

    colours(field, columns, order) {
      const colours = new Uint8Array(4 * order.length);
      const put = (k, [red, green, blue]) => {
        colours[4 * k] = red;
        colours[4 * k + 1] = green;
        colours[4 * k + 2] = blue;
        colours[4 * k + 3] = 255;
      };
      if (field.names) {
        const which = field.name === "body" ? this.run.body : this.run.material;
        const shades = this.shadesOfNames(field);
        for (let k = 0; k < order.length; k++) put(k, shades[which[order[k]]]);
        return colours;
      }
      const column = this.run.column(field.name);
      const [low, high] = this.run.about.frames[this.frame].ranges[column];
      const [first, last] = this.viewer.limits(field.name);
      const scale = (field.shades.length - 1) / (last - first || 1);
      const offset = (low - first) * scale + 0.5;
      const step = ((high - low) / LEVELS) * scale;
      const codes = columns[column];
      for (let k = 0; k < order.length; k++) {
        const code = codes[order[k]];
        const shade = Math.min(Math.max(Math.floor(offset + step * code), 0), field.shades.length - 1);
        put(k, code === NO_VALUE ? GREY : field.shades[shade]);
      }
      return colours;
    }

    shadesOfNames(field) {
      const colours = this.viewer.palette;
      return field.names.map((_, k) => rgb(colours[k % colours.length]));
    }

    // ---- axes and lines, over the particles

    drawMarks() {
      const { stage, marks } = this;
      const ratio = window.devicePixelRatio || 1;
      const [width, height] = [stage.clientWidth, stage.clientHeight];
      marks.width = Math.round(width * ratio);
      marks.height = Math.round(height * ratio);
      const pen = marks.getContext("2d");
      pen.scale(ratio, ratio);
      const style = getComputedStyle(this.viewer.root);
      const colour = (name) => {
        const probe = this.viewer.probe;
        probe.style.color = style.getPropertyValue(`--${name}`);
        return getComputedStyle(probe).color;
      };
      const scale = 2 ** this.view.zoom;
      const x = (z) => width / 2 + (z - this.view.target[0]) * scale;
      const y = (r) => height / 2 - (r - this.view.target[1]) * scale;
      const line = (points, stroke, dash, thick) => {
        pen.beginPath();
        points.forEach(([a, b], k) => (k ? pen.lineTo(a, b) : pen.moveTo(a, b)));
        pen.strokeStyle = stroke;
        pen.lineWidth = thick;
        pen.setLineDash(dash);
        pen.stroke();
      };
      const [low, high] = this.run.about.planes;
      if (low !== null) this.shade(pen, colour("stage-soft"), 0, x(low), height);
      if (high !== null) this.shade(pen, colour("stage-soft"), x(high), width, height);
      line([[0, y(0)], [width, y(0)]], colour("stage-soft"), [8, 3, 2, 3], 0.8);
      for (const z of this.run.about.faces) line([[x(z), 0], [x(z), height]], colour("stage-soft"), [], 0.9);
      if (this.viewer.lines) {
        for (const found of this.run.about.frames[this.frame].lines) {
          const stroke = colour(`stage-${found.kind}`);
          const dash = found.kind === "measured" ? [7, 4] : [2, 2.5];
          if (found.length !== null) line([[x(found.front), 0], [x(found.front), height]], stroke, dash, 1.6);
          if (found.radius !== null) {
            for (const side of [1, -1]) {
              const level = y(side * found.radius);
              line([[x(found.rear), level], [x(found.front), level]], stroke, dash, 1.6);
            }
          }
        }
      }
      this.drawTicks(pen, colour("stage-ink"), colour("stage"), x, y, scale, width, height);
    }

    // What lies behind a rigid plane.
    shade(pen, colour, left, right, height) {
      if (right <= left) return;
      pen.fillStyle = colour;
      pen.globalAlpha = 0.3;
      pen.fillRect(left, 0, right - left, height);
      pen.globalAlpha = 1;
    }

    drawTicks(pen, ink, paper, x, y, scale, width, height) {
      pen.font = "12px system-ui, sans-serif";
      pen.setLineDash([]);
      pen.strokeStyle = ink;
      pen.lineWidth = 1;
      const write = (text, a, b, align, base) => {
        pen.textAlign = align;
        pen.textBaseline = base;
        const wide = pen.measureText(text).width + 4;
        const left = a - 2 - { left: 0, center: wide / 2 - 2, right: wide - 4 }[align];
        const top = b - { top: 1, middle: 8, bottom: 15 }[base];
        pen.fillStyle = paper;
        pen.globalAlpha = 0.75;
        pen.fillRect(left, top, wide, 16);
        pen.globalAlpha = 1;
        pen.fillStyle = ink;
        pen.fillText(text, a, b);
      };
      const tick = (a, b, c, d) => {
        pen.lineWidth = 1;
        pen.strokeStyle = ink;
        pen.beginPath();
        pen.moveTo(a, b);
        pen.lineTo(c, d);
        pen.stroke();
      };
      const step = niceStep(Math.min(width, 700) / scale, 6);
      const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      const text = (value) => value.toFixed(digits).replace("-", "−");
      const from = (low) => Math.ceil(low / step) * step;
      const zLow = this.view.target[0] - width / 2 / scale;
      for (let z = from(zLow); x(z) < width - 58; z += step) {
        tick(x(z), height, x(z), height - 5);
        if (x(z) > 26) write(text(z + 0), x(z), height - 7, "center", "bottom");
      }
      write("z [mm]", width - 6, height - 7, "right", "bottom");
      const rLow = this.view.target[1] - height / 2 / scale;
      for (let r = from(rLow); y(r) > 30; r += step) {
        if (y(r) > height - 26) continue;
        tick(0, y(r), 5, y(r));
        write(text(Math.abs(r)), 8, y(r), "left", "middle");
      }
      write("r [mm]", 8, 5, "left", "top");
    }

    drawKey() {
      this.key.replaceChildren();
      if (!this.viewer.lines) return;
      for (const found of this.run.about.frames[this.frame].lines) {
        const item = make("span");
        const mark = make("b", "", found.kind === "measured" ? "– – " : "····· ");
        mark.style.color = `var(--${found.kind})`;
        const sizes = [["R", found.radius], ["L", found.length]].filter(([, size]) => size !== null);
        item.append(mark, `${found.kind}: `);
        sizes.forEach(([letter, size], k) => {
          item.append(k ? ", " : "", letter, make("sub", "", "b"), ` = ${size.toFixed(1)} mm`);
        });
        this.key.append(item);
      }
    }

    // ---- the particle under the pointer

    point(info) {
      if (!info || info.index < 0 || !info.layer || !this.order || info.index >= this.order.length) {
        this.hovered = null;
        this.tip.hidden = true;
        return;
      }
      this.hovered = { index: info.index, layer: info.layer, x: info.x, y: info.y };
      const values = this.values(this.order[info.index]);
      const table = make("table");
      table.append(make("caption", "", values[0][1]));
      for (const [name, text] of values.slice(1)) {
        const row = make("tr");
        row.append(make("th", "", name), make("td", "", text));
        table.append(row);
      }
      this.tip.replaceChildren(table);
      this.tip.hidden = false;
      const [width, height] = [this.stage.clientWidth, this.stage.clientHeight];
      const left = info.x > width / 2 ? info.x - this.tip.offsetWidth - 12 : info.x + 12;
      this.tip.style.left = `${Math.min(Math.max(left, 2), Math.max(width - this.tip.offsetWidth - 2, 2))}px`;
      this.tip.style.top = `${Math.min(Math.max(info.y - this.tip.offsetHeight / 2, 2), Math.max(height - this.tip.offsetHeight - 2, 2))}px`;
    }

    values(i) {
      const { run, frame } = this;
      const body = run.about.bodies[run.body[i]].name;
      const rows = [["", `particle ${run.ids[i]} of ${body}`]];
      rows.push(["z", `${shortNumber(run.value(frame, 0, i))} mm`]);
      rows.push(["r", `${shortNumber(run.value(frame, 1, i))} mm`]);
      run.about.fields.forEach((field, k) => {
        const value = run.value(frame, 2 + k, i);
        rows.push([field.label, value === null ? "–" : `${shortNumber(value)} ${field.unit}`.trim()]);
      });
      rows.push(["material", run.about.materials[run.material[i]]]);
      return rows;
    }
  }

  // ---- all runs on one clock

  class Viewer {
    constructor(root, runs) {
      this.root = root;
      this.runs = runs;
      this.within = "within" in root.dataset;
      this.Layer = particleLayer();
      this.linked = true;
      this.lines = true;
      this.chosen = new Map();
      this.hidden = new Set();
      this.visibleOf = new Map();
      this.palette = runs[0].about.palette;
      this.above = root.dataset.field;
      this.below = root.dataset.below;
      this.speed = 10;
      this.probe = make("span");
      this.probe.hidden = true;
      this.panels = make("div", "viewer-panels");
      this.setTimes();
      this.position = this.times.length - 1;
      this.makeControls();
      root.append(this.top, this.panels, this.options, this.scales, this.help(), this.probe);
      this.items = runs.map((run) => new Panel(this, run));
      this.items.forEach((panel) => panel.start());
      this.show(this.position);
      this.drawScales();
      root.addEventListener("keydown", (event) => this.press(event));
      const redraw = () => this.items.forEach((panel) => panel.drawMarks());
      window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    }

    setTimes() {
      const all = this.runs.flatMap((run) => run.times).sort((a, b) => a - b);
      this.times = all.filter((time, k) => !k || time > all[k - 1] * (1 + 1e-9));
      const views = this.runs.map((run) => run.about.view);
      this.union = {
        z_low: Math.min(...views.map((v) => v.z_low)),
        z_high: Math.max(...views.map((v) => v.z_high)),
        r_high: Math.max(...views.map((v) => v.r_high)),
      };
    }

    get fieldNames() {
      const names = new Map();
      for (const run of this.runs) for (const field of run.fields) names.set(field.name, field.label);
      return [...names];
    }

    field(name) {
      for (const run of this.runs) {
        const found = run.fields.find((field) => field.name === name);
        if (found) return found;
      }
      return this.runs[0].field("body");
    }

    // Limits of the colours: those typed in, or those between which the runs' values lie.
    limits(name) {
      if (this.chosen.has(name)) return this.chosen.get(name);
      const fields = this.runs.flatMap((run) => run.about.fields.filter((f) => f.name === name));
      return [Math.min(...fields.map((f) => f.low)), Math.max(...fields.map((f) => f.high))];
    }

    visible(run) {
      if (!this.visibleOf.has(run)) {
        const shown = run.about.bodies.map((body) => !this.hidden.has(body.name));
        const order = [];
        for (let i = 0; i < run.body.length; i++) if (shown[run.body[i]]) order.push(i);
        this.visibleOf.set(run, Uint32Array.from(order));
      }
      return this.visibleOf.get(run);
    }

    // ---- controls

    makeControls() {
      this.top = make("div", "viewer-bar");
      this.button = make("button", "viewer-play", "Play");
      this.button.type = "button";
      this.button.addEventListener("click", () => this.toggle());
      const clock = make("div", "viewer-clock");
      this.slider = make("input");
      Object.assign(this.slider, { type: "range", min: 0, step: 1 });
      this.slider.setAttribute("aria-label", "time");
      this.slider.addEventListener("input", () => { this.stop(); this.show(Number(this.slider.value)); });
      this.reading = make("output");
      clock.append(this.slider, this.reading);
      const [speed] = chooser("frames/s", SPEEDS.map((n) => [n, String(n)]), this.speed, (n) => { this.speed = Number(n); });
      this.top.append(this.button, clock, speed);

      this.options = make("div", "viewer-bar");
      const names = this.fieldNames;
      const [above, aboveSelect] = chooser("colours", names, this.above, (name) => this.choose(name, this.same ? name : this.below));
      const below = [["", "the same"], ...names];
      const [belowBox, belowSelect] = chooser("below the axis", below, "", (name) => this.choose(this.above, name || this.above));
      belowSelect.value = this.same ? "" : this.below;
      this.selects = [aboveSelect, belowSelect];
      this.options.append(above, belowBox, this.zoomBox());
      for (const [name, colour] of this.bodies()) {
        const box = make("label");
        const tick = make("input");
        Object.assign(tick, { type: "checkbox", checked: true });
        tick.addEventListener("change", () => this.setBody(name, tick.checked));
        const swatch = make("span", "viewer-swatch");
        swatch.style.background = colour;
        box.append(tick, swatch, make("span", "viewer-name", name));
        this.options.append(box);
      }
      if (this.runs.some((run) => run.about.frames.some((frame) => frame.lines.length))) {
        this.options.append(this.tickBox("R and L", true, (on) => { this.lines = on; this.redraw(); }));
      }
      if (this.runs.length > 1) {
        this.options.append(this.tickBox("one view", true, (on) => { this.linked = on; this.fit(); }));
      }
      if (!this.within) {
        const dark = make("button", "", "Dark / light");
        dark.type = "button";
        dark.addEventListener("click", () => this.turn());
        this.options.append(dark);
      }
      this.scales = make("div", "viewer-bar");
    }

    get same() {
      return this.above === this.below;
    }

    bodies() {
      const found = new Map();
      for (const run of this.runs) for (const body of run.about.bodies) if (!found.has(body.name)) found.set(body.name, body.colour);
      return [...found];
    }

    tickBox(text, on, change) {
      const box = make("label");
      const tick = make("input");
      Object.assign(tick, { type: "checkbox", checked: on });
      tick.addEventListener("change", () => change(tick.checked));
      box.append(tick, text);
      return box;
    }

    zoomBox() {
      const options = [["", "everything"], ...this.bodies().map(([name]) => [`body ${name}`, name])];
      const [box, select] = chooser("view", options, "", (key) => (key ? this.zoomOn(key.slice(5)) : this.fit()));
      this.zoomSelect = select;
      return box;
    }

    help() {
      const box = make("details", "viewer-help");
      box.append(make("summary", "", "Keys and gestures"));
      const text = "Drag to move, turn the wheel or pinch to zoom, double-click or 0 to see everything; hover over a particle, or tap it, for its values. "
        + "Space plays and pauses, ← and → go from frame to frame, Home and End to the first and last, + and − zoom, F takes the next field. "
        + (this.within ? "The wheel zooms once the picture was clicked. " : "")
        + "Each particle has the section of its ring at rest density. Values are stored in 16 bits: they are off by at most 1/131068 of the range that they have in a frame.";
      box.append(make("p", "", text));
      return box;
    }

    turn() {
      const root = document.documentElement;
      const now = getComputedStyle(this.probe).colorScheme;
      const dark = root.classList.contains("dark")
        || (!root.classList.contains("light") && now.includes("dark") && window.matchMedia("(prefers-color-scheme: dark)").matches);
      root.classList.toggle("dark", !dark);
      root.classList.toggle("light", dark);
      this.items.forEach((panel) => panel.drawMarks());
    }

    choose(above, below) {
      this.above = above;
      this.below = below;
      this.selects[0].value = above;
      this.selects[1].value = this.same ? "" : below;
      this.drawScales();
      this.redraw();
    }

    drawScales() {
      this.scales.replaceChildren();
      // The boxes that switch bodies on and off tell their colours.
      const halves = (this.same ? [["", this.above]] : [["above: ", this.above], ["below: ", this.below]])
        .filter(([, name]) => name !== "body");
      for (const [where, name] of halves) {
        const field = this.field(name);
        const box = make("div", field.names ? "viewer-key" : "viewer-scale");
        if (field.names) {
          box.append(`${where}${field.label}`);
          const keys = this.runs.filter((run) => run.has(name)).flatMap((run) => run.field(name).names.map((text, k) => `${k % this.palette.length} ${text}`));
          for (const key of new Set(keys)) {
            const item = make("span");
            const swatch = make("span", "viewer-swatch");
            swatch.style.background = this.palette[Number(key[0])];
            item.append(swatch, key.slice(1));
            box.append(item);
          }
        } else {
          const ends = this.limits(name).map((limit, k) => {
            const input = make("input");
            Object.assign(input, { type: "number", step: "any", value: Number(limit.toPrecision(4)) });
            input.setAttribute("aria-label", `${k ? "highest" : "lowest"} ${withUnit(field)} of the colours`);
            input.addEventListener("change", () => this.setLimit(name, k, input));
            return input;
          });
          const bar = make("div", "viewer-gradient");
          const shades = field.shades.map((shade) => `rgb(${shade.join(" ")})`);
          bar.style.background = `linear-gradient(to right, ${shades.join(", ")})`;
          const grey = field.missing ? "; grey: its model gives none" : "";
          box.append(make("span", "viewer-label", `${where}${withUnit(field)}${grey}`), ends[0], bar, ends[1]);
        }
        this.scales.append(box);
      }
    }

    // An emptied or impossible limit brings back those of the runs.
    setLimit(name, end, input) {
      const limits = [...this.limits(name)];
      limits[end] = input.value === "" ? NaN : Number(input.value);
      if (Number.isFinite(limits[end]) && limits[0] < limits[1]) this.chosen.set(name, limits);
      else this.chosen.delete(name);
      this.drawScales();
      this.redraw();
    }

    setBody(name, on) {
      if (on) this.hidden.delete(name);
      else this.hidden.add(name);
      this.visibleOf.clear();
      this.redraw();
    }

    // ---- the view

    move(panel, viewState) {
      const { target, zoom } = viewState;
      this.zoomSelect.value = "";
      for (const item of this.linked ? this.items : [panel]) item.setView({ target, zoom });
    }

    fit() {
      this.zoomSelect.value = "";
      this.items.forEach((panel) => panel.setView(panel.fitted(panel.whole()), true));
    }

    zoomOn(name) {
      for (const panel of this.items) {
        const { run, frame } = panel;
        const body = run.about.bodies.findIndex((each) => each.name === name);
        const columns = run.columns(frame);
        if (body < 0 || !columns) continue;
        const ranges = run.about.frames[frame].ranges;
        const [z, r] = [0, 1].map((k) => restored(columns[k], ranges[k]).filter((_, i) => run.body[i] === body).sort());
        if (!z.length) continue;
        // Without the few particles that fly far.
        const at = (values, share) => values[Math.round(share * (values.length - 1))];
        const [low, high, top] = [at(z, 0.02), at(z, 0.98), at(r, 0.98)];
        const room = 0.08 * Math.max(high - low, 2 * top, 1e-6);
        panel.setView(panel.fitted({ z_low: low - room, z_high: high + room, r_high: top + room }));
      }
      this.zoomSelect.value = `body ${name}`;
    }

    zoomBy(factor) {
      for (const panel of this.items) panel.setView({ zoom: panel.view.zoom + factor });
    }

    // ---- time

    show(position) {
      this.position = Math.min(Math.max(position, 0), this.times.length - 1);
      const time = this.times[this.position];
      this.slider.max = this.times.length - 1;
      this.slider.value = this.position;
      this.reading.textContent = `${shortNumber(time)} µs`;
      this.slider.setAttribute("aria-valuetext", this.reading.textContent);
      for (const panel of this.items) panel.show(panel.run.frameAt(time));
    }

    redraw() {
      this.items.forEach((panel) => panel.draw());
    }

    toggle() {
      if (this.timer) this.stop();
      else this.play();
    }

    play() {
      if (this.position >= this.times.length - 1) this.show(0);
      this.button.textContent = "Pause";
      let due = performance.now() + 1000 / this.speed;
      const step = (now) => {
        if (!this.timer) return;
        if (now >= due) {
          due = Math.max(due + 1000 / this.speed, now);
          if (this.position >= this.times.length - 1) { this.stop(); return; }
          this.show(this.position + 1);
        }
        this.timer = requestAnimationFrame(step);
      };
      this.timer = requestAnimationFrame(step);
    }

    stop() {
      cancelAnimationFrame(this.timer);
      this.timer = 0;
      this.button.textContent = "Play";
    }

    press(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const typing = event.target.matches("input[type=number], select");
      const onButton = event.target.matches("button, summary, input[type=checkbox]");
      const onSlider = event.target === this.slider;
      const keys = {
        " ": () => this.toggle(),
        ArrowRight: () => { this.stop(); this.show(this.position + 1); },
        ArrowLeft: () => { this.stop(); this.show(this.position - 1); },
        Home: () => { this.stop(); this.show(0); },
        End: () => { this.stop(); this.show(this.times.length - 1); },
        "+": () => this.zoomBy(0.5),
        "=": () => this.zoomBy(0.5),
        "-": () => this.zoomBy(-0.5),
        0: () => this.fit(),
        f: () => {
          const names = this.fieldNames.map(([name]) => name);
          const next = names[(names.indexOf(this.above) + 1) % names.length];
          this.choose(next, this.same ? next : this.below);
        },
      };
      const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!act || typing || (onButton && event.key === " ") || (onSlider && event.key !== " " && event.key.length > 1)) return;
      event.preventDefault();
      act();
    }

    // Takes over runs that have gone on; whoever looks at the end goes on looking at it.
    refresh() {
      const atEnd = this.position >= this.times.length - 1;
      const time = this.times[this.position];
      this.visibleOf.clear();
      this.setTimes();
      this.drawScales();
      if (atEnd) this.show(this.times.length - 1);
      else this.show(Math.max(this.times.findIndex((t) => t >= time * (1 - 1e-9)), 0));
    }
  }

  // ---- start

  async function storedRuns(root) {
    const parts = (kind) => [...root.querySelectorAll(`script.viewer-${kind}`)];
    const fixed = parts("fixed");
    const frames = parts("frame");
    const runs = [];
    for (const [index, part] of parts("run").entries()) {
      const run = new Run(JSON.parse(part.textContent));
      await run.setFixed(bytesOf(fixed[index].textContent));
      const mine = frames.filter((frame) => Number(frame.dataset.run) === index);
      run.about.frames.forEach((frame, k) => { frame.key = k; });
      for (const [k, frame] of mine.entries()) {
        await run.addFrame(k, bytesOf(frame.textContent));
        frame.remove();
      }
      runs.push(run);
    }
    return runs;
  }

  async function servedRuns(before) {
    const fetched = async (path) => {
      const answer = await fetch(path, { cache: "no-store" });
      if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
      return answer;
    };
    const about = await (await fetched("runs.json")).json();
    const runs = [];
    for (const [index, description] of about.runs.entries()) {
      const known = before && before[index].about.particles === description.particles ? before[index] : null;
      const run = known || new Run(description);
      if (!known) await run.setFixed(new Uint8Array(await (await fetched(`runs/${index}/fixed`)).arrayBuffer()));
      for (const frame of description.frames) {
        if (run.known.has(frame.key)) continue;
        await run.addFrame(frame.key, new Uint8Array(await (await fetched(`runs/${index}/frames/${frame.key}`)).arrayBuffer()));
      }
      run.describe(description);
      runs.push(run);
    }
    return { runs, over: about.over };
  }

  async function follow(viewer) {
    for (;;) {
      await new Promise((done) => { setTimeout(done, 2000); });
      let found;
      try {
        found = await servedRuns(viewer.runs);
      } catch (error) {
        viewer.root.append(make("p", "viewer-note", "The program that serves this page has ended."));
        return;
      }
      viewer.refresh();
      if (found.over) return;
    }
  }

  function canDraw() {
    const canvas = document.createElement("canvas");
    return Boolean(canvas.getContext("webgl2")) && "DecompressionStream" in window;
  }

  async function start(root) {
    if (!canDraw()) {
      root.querySelector(".viewer-pictures").hidden = false;
      return;
    }
    const note = make("p", "viewer-note", "Unpacking…");
    root.append(note);
    try {
      if (!window.deck) {
        const packed = document.getElementById("viewer-library").textContent;
        const code = make("script");
        code.textContent = new TextDecoder().decode(await inflate(bytesOf(packed)));
        document.head.append(code);
      }
      const served = "served" in root.dataset ? await servedRuns(null) : null;
      const runs = served ? served.runs : await storedRuns(root);
      note.remove();
      root.viewer = new Viewer(root, runs);
      root.dataset.ready = "";
      if (served && !served.over) follow(root.viewer);
    } catch (error) {
      console.error(error);
      note.textContent = `The particles cannot be shown: ${error.message}`;
      root.querySelector(".viewer-pictures").hidden = false;
    }
  }

  for (const root of document.querySelectorAll(".viewer")) start(root);
})();
