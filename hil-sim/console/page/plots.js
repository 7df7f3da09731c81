// Live plots with one cursor.

// Of each plot: its name, unit, and lines: name, place in the history, colour, dash.
const SOLID = [];
const DASHED = [8, 5];
const DOTTED = [2, 4];
const DASHED_DOTTED = [8, 3, 2, 3];
const PLOTS = [
  ["Speed", "m/s", [["commanded", "commanded_speed", "--c2", DASHED], ["reference", "reference_speed", "--c3", DOTTED], ["estimated", "speed", "--c1", SOLID], ["true", "true_speed", "--c4", DASHED_DOTTED]]],
  ["Angles", "°", [["arm", "phi", "--c1", SOLID], ["arm, true", "true_phi", "--c4", DASHED_DOTTED], ["spar", "spar", "--c3", SOLID], ["slope", "slope", "--c6", DOTTED]]],
  ["Yaw rate", "rad/s", [["commanded", "commanded_yaw", "--c2", DASHED], ["reference", "reference_yaw", "--c3", DOTTED], ["estimated", "yaw", "--c1", SOLID], ["true", "true_yaw", "--c4", DASHED_DOTTED]]],
  ["Voltages", "V", [["left", "voltage_left", "--c1", SOLID], ["right", "voltage_right", "--c2", DASHED], ["ballast", "voltage_ballast", "--c3", DOTTED], ["supply", "battery", "--c6", SOLID]]],
  ["Currents", "A", [["left", "current_left", "--c1", SOLID], ["right", "current_right", "--c2", DASHED], ["ballast", "current_ballast", "--c3", DOTTED]]],
  ["Slip", "m/s", [["left, true", "slip_left", "--c1", SOLID], ["right, true", "slip_right", "--c2", DASHED]]],
];
const NAMES = [...new Set(PLOTS.flatMap(([, , lines]) => lines.map(([, column]) => column)))];
// Rows that a live history keeps: two minutes.
const ROWS_MAX = 12_000;
/** Least height of a plot, in its unit: rounding errors do not fill it. */
const SPAN_MIN = 0.01;
/** The range of a vertical axis around what is drawn. */
function span(_, min, max) {
  if (min == null || max == null) return [null, null];
  if (max - min >= SPAN_MIN) return uPlot.rangeNum(min, max, 0.1, true);
  const middle = 0.5 * (min + max);
  return [middle - 0.5 * SPAN_MIN, middle + 0.5 * SPAN_MIN];
}
/** A number at an axis: as many digits as it needs, however small the axis is. */
const tickText = (value) => String(Number(value.toPrecision(6)));

/** What was, column by column. */
export class History {
  constructor(rowsMax = ROWS_MAX) {
    this.rowsMax = rowsMax;
    this.times = [];
    this.columns = Object.fromEntries(NAMES.map((name) => [name, []]));
  }

  push(time, row) {
    // The board has booted: its clock begins again.
    if (this.times.length && time < this.times.at(-1)) this.clear();
    this.times.push(time);
    for (const name of NAMES) this.columns[name].push(row[name] ?? null);
    if (this.times.length > this.rowsMax * 1.2) {
      const surplus = this.times.length - this.rowsMax;
      for (const column of [this.times, ...Object.values(this.columns)]) column.splice(0, surplus);
    }
  }

  clear() {
    this.times.length = 0;
    for (const column of Object.values(this.columns)) column.length = 0;
  }

  /** Place of the first time that is at least `time`. */
  place(time) {
    let [low, high] = [0, this.times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

export class Plots {
  /** `onzoom()` is called when a person has dragged over a plot: a zoom stays only while no new data is drawn. */
  constructor(parent, onzoom) {
    this.parent = parent;
    this.onzoom = onzoom;
    /** The mouse is down over a plot. */
    this.dragged = false;
    parent.addEventListener("mousedown", () => (this.dragged = true));
    addEventListener("mouseup", () => (this.dragged = false));
    this.plots = [];
    this.visible = new Set();
    this.watcher = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (isIntersecting) this.visible.add(target);
        else this.visible.delete(target);
      }
    }, { rootMargin: "100px" });
    new ResizeObserver(() => this.resize()).observe(parent);
    this.build();
  }

  /** Builds the plots, in the colours of the present theme. */
  build() {
    for (const { plot, box } of this.plots) {
      this.watcher.unobserve(box);
      plot.destroy();
    }
    this.parent.replaceChildren();
    this.visible.clear();
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const axis = { stroke: colour("--quiet"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
    this.plots = PLOTS.map(([title, unit, lines]) => {
      const box = document.createElement("div");
      box.className = "plot";
      const head = document.createElement("h3");
      head.textContent = `${title}, ${unit}`;
      box.append(head);
      this.parent.append(box);
      const options = {
        width: this.width(),
        height: 190,
        cursor: { sync: { key: "console" }, drag: { x: true, y: false } },
        legend: {
          markers: {
            width: 3,
            stroke: (_, n) => (n ? colour(lines[n - 1][2]) : "transparent"),
            fill: () => "transparent",
            dash: (_, n) => ({ [SOLID]: "solid", [DASHED]: "dashed", [DOTTED]: "dotted" })[lines[n - 1]?.[3]] ?? "solid",
          },
        },
        hooks: { setSelect: [(plot) => plot.select.width > 0 && this.onzoom()] },
        scales: { x: { time: false }, y: { range: span } },
        axes: [{ ...axis, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: 60, values: (_, ticks) => ticks.map(tickText) }],
        series: [
          { label: "t", value: (_, value) => (value == null ? "–" : `${value.toFixed(2)} s`) },
          ...lines.map(([label, , name, dash]) => ({
            label, stroke: colour(name), dash, width: 1.8, spanGaps: false, points: { show: false },
            value: (_, value) => (value == null ? "–" : value.toFixed(Math.abs(value) < 0.1 ? 4 : 2)),
          })),
        ],
      };
      const plot = new uPlot(options, [[], ...lines.map(() => [])], box);
      // No border has dashes and dots: the legend shows such a line as a picture.
      plot.root.querySelectorAll(".u-marker").forEach((marker, n) => {
        if (lines[n - 1]?.[3] !== DASHED_DOTTED) return;
        const own = colour(lines[n - 1][2]);
        marker.style.borderImage = `repeating-linear-gradient(90deg, ${own} 0 7px, transparent 7px 9px, ${own} 9px 11px, transparent 11px 13px) 1`;
      });
      this.watcher.observe(box);
      return { plot, box, lines };
    });
  }

  width() {
    const columns = Math.max(1, Math.floor((this.parent.clientWidth + 14) / 444));
    return Math.max(240, Math.floor((this.parent.clientWidth - 14 * (columns - 1)) / columns));
  }

  resize() {
    const width = this.width();
    for (const { plot } of this.plots) if (plot.width !== width) plot.setSize({ width, height: 190 });
  }

  /** Draws a history from place `from` on. */
  draw(history, from) {
    if (this.dragged) return;
    const times = history.times.slice(from);
    for (const { plot, box, lines } of this.plots) {
      if (!this.visible.has(box)) continue;
      plot.setData([times, ...lines.map(([, column]) => history.columns[column].slice(from))]);
    }
  }
}
