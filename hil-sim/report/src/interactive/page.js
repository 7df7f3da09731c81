"use strict";
// Draws the page's data: charts with a shared cursor and zoom, the strip of what happened, the vehicle, and the scrubber.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const byId = (id) => document.getElementById(id);

  // One colour and one line for one meaning, here as on the console: the word in a curve's name decides. A second quantity
  // has shorter dashes.
  const MEANINGS = [
    [/commanded/, "--commanded", [8, 5]],
    [/estimated|dead reckoning/, "--estimated", []],
    [/reference/, "--reference", [2, 4]],
    [/true/, "--true", [8, 3, 2, 3]],
  ];
  // Curves of no such meaning differ by their line as well as by their colour.
  const COLOURS = 9;
  const LINES = [[], [6, 4], [2, 3]];
  const ownLine = (k) => LINES[(k + Math.floor(k / COLOURS)) % LINES.length];
  function looks(series) {
    const quantities = [];
    return series.map((one, k) => {
      const quantity = one.name.includes(",") ? one.name.split(",")[0] : "";
      if (!quantities.includes(quantity)) quantities.push(quantity);
      const place = quantities.indexOf(quantity);
      const meaning = MEANINGS.find(([word]) => word.test(one.name));
      const dash = meaning ? meaning[2] : ownLine(k);
      return {
        stroke: () => css(meaning ? meaning[1] : `--c${k % COLOURS}`),
        width: !meaning || place === 0 ? 1.8 : 1.2,
        dash: !meaning || place === 0 ? dash : dash.length > 2 ? [3 + place, 2, 1, 2] : [1 + 2 * place, 3],
      };
    });
  }

  const time = data.time;
  const plots = [];
  let index = 0;
  let quiet = false;
  // The shortest range that the buttons zoom to, s.
  const SHORTEST_S = 0.1;

  function number(value) {
    if (value === null || value === undefined || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  }

  function zoom(from, min, max) {
    if (quiet) return;
    quiet = true;
    for (const plot of plots) if (plot !== from && plot.shared) plot.setScale("x", { min, max });
    quiet = false;
    strip(min, max);
  }

  // Shows this range in every chart over time, and in the strip.
  function range(min, max) {
    quiet = true;
    for (const plot of plots) if (plot.shared) plot.setScale("x", { min, max });
    quiet = false;
    strip(min, max);
    point();
  }
  // Shows a range this many times as long, with the cursor in its middle as far as the run goes.
  function zoomBy(factor) {
    const shown = plots.find((plot) => plot.shared)?.scales.x;
    const [first, last] = [time[0], time[time.length - 1]];
    if (!shown || shown.min == null) return;
    const length = Math.min(Math.max((shown.max - shown.min) * factor, Math.min(SHORTEST_S, last - first)), last - first);
    const min = Math.min(Math.max(time[index] - length / 2, first), last - length);
    range(min, min + length);
  }

  function draw(chart, holder) {
    const shared = Boolean(time) && chart.over_time;
    const x = shared ? time : chart.x;
    const axis = (label) => ({
      label,
      labelSize: 22,
      labelFont: "12px system-ui, sans-serif",
      font: "12px system-ui, sans-serif",
      stroke: () => css("--quiet"),
      grid: { stroke: () => css("--grid"), width: 1 },
      ticks: { stroke: () => css("--grid"), width: 1 },
    });
    const lines = looks(chart.series);
    const plot = new uPlot(
      {
        width: Math.max(holder.clientWidth, 240),
        height: 260,
        scales: {
          x: { time: false },
          y: chart.log_y ? { distr: 3 } : chart.y_range ? { range: chart.y_range } : {},
        },
        series: [
          { label: chart.x_label, value: (_, value) => number(value) },
          ...chart.series.map((one, k) => ({
            label: one.name,
            value: (_, value) => number(value),
            points: { show: Boolean(chart.marks), size: 9, width: 2 },
            spanGaps: !shared,
            ...lines[k],
            ...(chart.marks ? { paths: () => null } : {}),
          })),
        ],
        // The legend shows a curve's line as well as its colour.
        legend: {
          markers: {
            width: 3,
            fill: () => "transparent",
            stroke: (_, k) => (k ? lines[k - 1].stroke() : "transparent"),
            dash: (_, k) => {
              const [stroke] = lines[k - 1]?.dash ?? [];
              return stroke === undefined ? "solid" : stroke > 4 ? "dashed" : "dotted";
            },
          },
        },
        axes: [axis(chart.x_label), { ...axis(chart.y_label), size: 58 }],
        cursor: { sync: shared ? { key: "run" } : undefined, drag: { x: true, y: false, uni: 20 } },
        hooks: {
          setScale: [(u, key) => shared && key === "x" && u.status && zoom(u, u.scales.x.min, u.scales.x.max)],
          setCursor: [(u) => shared && !quiet && u.cursor.event && typeof u.cursor.idx === "number" && show(u.cursor.idx)],
        },
      },
      [x, ...chart.series.map((one) => one.values)],
      holder,
    );
    plot.shared = shared;
    // The legend's markers keep the colour with which they were made. No border has dashes and dots: such a line is a picture.
    const mark = () => plot.root.querySelectorAll(".u-marker").forEach((marker, k) => {
      if (!k) return;
      const colour = lines[k - 1].stroke();
      marker.style.borderColor = colour;
      if (lines[k - 1].dash.length > 2) {
        marker.style.borderImage = `repeating-linear-gradient(90deg, ${colour} 0 7px, transparent 7px 9px, ${colour} 9px 11px, transparent 11px 13px) 1`;
      }
    });
    mark();
    plot.recolour = () => {
      mark();
      plot.redraw();
    };
    plots.push(plot);
  }

  // What happened, a lane for each kind, over the range that the charts show.
  function strip(min, max) {
    const holder = byId("strip");
    if (!holder || !time) return;
    holder.textContent = "";
    const lanes = new Map();
    for (const event of data.events) {
      const until = event.for_s === null ? event.at_s : event.at_s + event.for_s;
      if (until < min || event.at_s > max) continue;
      let lane = lanes.get(event.kind);
      if (!lane) {
        const row = document.createElement("div");
        row.className = event.trouble ? "lane trouble" : "lane";
        const name = document.createElement("span");
        name.textContent = event.kind;
        lane = document.createElement("div");
        row.append(name, lane);
        holder.append(row);
        lanes.set(event.kind, lane);
      }
      const bar = document.createElement("i");
      const share = (at) => (100 * (Math.min(Math.max(at, min), max) - min)) / (max - min || 1);
      bar.style.left = `${share(event.at_s)}%`;
      bar.style.width = `${share(until) - share(event.at_s)}%`;
      bar.title = `${event.at_s.toFixed(2)} s: ${event.text}`;
      lane.append(bar);
    }
    if (lanes.size === 0) {
      holder.textContent = "Nothing in this range.";
      return;
    }
    const cursor = document.createElement("div");
    cursor.className = "cursor";
    cursor.append(document.createElement("b"));
    holder.append(cursor);
    holder.dataset.range = `${min} ${max}`;
    mark();
  }
  // Where the cursor is, in the strip.
  function mark() {
    const line = document.querySelector("#strip .cursor b");
    if (!line) return;
    const [min, max] = byId("strip").dataset.range.split(" ").map(Number);
    const share = (time[index] - min) / (max - min || 1);
    line.style.left = `${100 * share}%`;
    line.hidden = share < 0 || share > 1;
  }

  // The vehicle from its right, and its path from above, both to scale.
  function canvas(id) {
    const element = byId(id);
    if (!element) return null;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [element.clientWidth, element.clientHeight];
    element.width = width * ratio;
    element.height = height * ratio;
    const pen = element.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    return { pen, width, height };
  }
  function line(pen, colour, width, points) {
    pen.strokeStyle = css(colour);
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([x, y], k) => (k === 0 ? pen.moveTo(x, y) : pen.lineTo(x, y)));
    pen.stroke();
  }
  function disc(pen, colour, [x, y], radius, outline) {
    pen.beginPath();
    pen.arc(x, y, Math.max(radius, 1), 0, 2 * Math.PI);
    pen.fillStyle = css(colour);
    pen.fill();
    if (outline) {
      pen.strokeStyle = css(outline);
      pen.lineWidth = 1.5;
      pen.stroke();
    }
  }
  function side() {
    const scene = data.scene;
    const view = scene && canvas("side");
    if (!view) return;
    const { pen, width, height } = view;
    const reach = Math.max(scene.wheel_radius_m, scene.arm_length_m, scene.camera_m) * 1.25;
    const unit = Math.min(width / (2.6 * reach), height / (2.2 * reach));
    const axle = [width / 2, height / 2];
    const at = (from, angle, length) => [from[0] + unit * length * Math.sin(angle), from[1] + unit * length * Math.cos(angle)];
    const slope = scene.slope[index];
    // The ground touches the wheel where its normal meets it.
    const foot = at(axle, slope, scene.wheel_radius_m);
    const along = [Math.cos(slope), -Math.sin(slope)];
    line(pen, "--ground", 3, [-1, 1].map((way) => [foot[0] + way * width * along[0], foot[1] + way * width * along[1]]));
    disc(pen, "--wheel", axle, unit * scene.wheel_radius_m, "--quiet");
    const spoke = scene.x[index] / scene.wheel_radius_m;
    for (let k = 0; k < 3; k += 1) {
      const angle = -spoke + (k * Math.PI) / 3;
      line(pen, "--line", 1, [at(axle, angle, scene.wheel_radius_m), at(axle, angle + Math.PI, scene.wheel_radius_m)]);
    }
    if (scene.camera_m > 0) {
      const spar = scene.spar[index];
      const motor = at(axle, spar, scene.motor_m);
      const camera = at(axle, spar + Math.PI, scene.camera_m);
      line(pen, "--c2", 3, [camera, motor]);
      pen.fillStyle = css("--c2");
      pen.fillRect(camera[0] - 6, camera[1] - 5, 12, 10);
      const ballast = at(motor, spar + scene.ballast[index], scene.ballast_m);
      line(pen, "--c2", 3, [motor, ballast]);
      disc(pen, "--c2", ballast, 5);
    }
    const mass = at(axle, scene.phi[index], scene.arm_length_m);
    line(pen, "--ink", 5, [axle, mass]);
    disc(pen, "--mass", mass, 8, "--ink");
    disc(pen, "--mass", axle, 3);
    pen.fillStyle = css("--quiet");
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(`phi ${((180 / Math.PI) * scene.phi[index]).toFixed(1)} deg`, 8, 18);
    pen.fillText(`slope ${((180 / Math.PI) * slope).toFixed(1)} deg`, 8, 34);
    if (scene.camera_m > 0) pen.fillText(`spar ${((180 / Math.PI) * scene.spar[index]).toFixed(2)} deg`, 8, 50);
  }
  function above() {
    const scene = data.scene;
    const view = scene && canvas("above");
    if (!view) return;
    const { pen, width, height } = view;
    const xs = scene.x.concat(scene.estimated_x);
    const ys = scene.y.concat(scene.estimated_y);
    const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
    const most = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
    const [left, right, low, high] = [least(xs), most(xs), least(ys), most(ys)];
    const unit = Math.min((width - 48) / Math.max(right - left, 0.5), (height - 48) / Math.max(high - low, 0.5));
    const spot = (x, y) => [width / 2 + unit * (x - (left + right) / 2), height / 2 - unit * (y - (low + high) / 2)];
    line(pen, "--estimated", 2.5, scene.estimated_x.map((x, k) => spot(x, scene.estimated_y[k])));
    pen.setLineDash([8, 3, 2, 3]);
    line(pen, "--true", 1.8, scene.x.map((x, k) => spot(x, scene.y[k])));
    pen.setLineDash([]);
    const here = spot(scene.x[index], scene.y[index]);
    const heading = scene.heading[index];
    disc(pen, "--true", here, 5, "--card");
    line(pen, "--ink", 2, [here, [here[0] + 16 * Math.cos(heading), here[1] - 16 * Math.sin(heading)]]);
    // A scale: the largest round length that fits a third of the picture.
    let length = 10 ** Math.floor(Math.log10(width / 3 / unit));
    for (const factor of [5, 2]) if (length * factor * unit < width / 3) { length *= factor; break; }
    line(pen, "--quiet", 2, [[12, height - 12], [12 + length * unit, height - 12]]);
    pen.fillStyle = css("--quiet");
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(`${number(length)} m`, 12, height - 18);
    pen.fillText(`x ${scene.x[index].toFixed(2)} m, y ${scene.y[index].toFixed(2)} m`, 8, 18);
  }

  function show(at) {
    index = Math.min(Math.max(at, 0), time.length - 1);
    const slider = byId("time");
    slider.value = String(index);
    const text = `${time[index].toFixed(2)} s`;
    byId("now").textContent = text;
    slider.setAttribute("aria-valuetext", text);
    mark();
    side();
    above();
  }
  // The charts' cursor follows the scrubber.
  function point() {
    quiet = true;
    for (const plot of plots) {
      if (!plot.shared) continue;
      plot.setCursor({ left: plot.valToPos(time[index], "x"), top: 10 }, false);
      plot.setLegend({ idx: index }, false);
    }
    quiet = false;
  }

  function all() {
    document.querySelectorAll("[data-chart]").forEach((holder) => draw(data.charts[Number(holder.dataset.chart)], holder));
    if (!time || time.length === 0) return;
    const slider = byId("time");
    slider.max = String(time.length - 1);
    slider.addEventListener("input", () => { show(Number(slider.value)); point(); });
    let timer = null;
    const play = byId("play");
    const stop = () => {
      clearInterval(timer);
      timer = null;
      play.textContent = "Play";
    };
    play.addEventListener("click", () => {
      if (timer !== null) return stop();
      if (index >= time.length - 1) index = 0;
      play.textContent = "Pause";
      let [before, now] = [performance.now(), time[index]];
      timer = setInterval(() => {
        const at = performance.now();
        now += (at - before) / 1000;
        before = at;
        let next = index;
        while (next < time.length - 1 && time[next] < now) next += 1;
        show(next);
        point();
        if (next === time.length - 1) stop();
      }, 40);
    });
    document.querySelectorAll("button[data-at]").forEach((button) =>
      button.addEventListener("click", () => {
        const at = Number(button.dataset.at);
        const found = time.findIndex((t) => t >= at);
        show(found < 0 ? time.length - 1 : found);
        point();
      }),
    );
    byId("whole").addEventListener("click", () => range(time[0], time[time.length - 1]));
    byId("closer").addEventListener("click", () => zoomBy(0.5));
    byId("wider").addEventListener("click", () => zoomBy(2));
    strip(time[0], time[time.length - 1]);
    show(0);
  }
  let width = 0;
  function fit() {
    if (width === window.innerWidth) return;
    width = window.innerWidth;
    for (const plot of plots) plot.setSize({ width: Math.max(plot.root.parentElement.clientWidth, 240), height: 260 });
    if (time) { side(); above(); }
  }
  all();
  width = window.innerWidth;
  window.addEventListener("resize", fit);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const plot of plots) plot.recolour();
    if (time) { side(); above(); }
  });
  document.documentElement.dataset.drawn = String(plots.length);
})();
