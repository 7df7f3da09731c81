// The vehicle to scale, from its right and from above.

const NS = "http://www.w3.org/2000/svg";

function add(parent, tag, attributes = {}) {
  const element = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  parent.append(element);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
}

const points = (list) => list.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
/** A number with so many decimals, and no minus before a nought. */
export const fixed = (value, decimals) => value.toFixed(decimals).replace(/^-(?=[0.]*$)/, "");
const degrees = (rad) => fixed((rad * 180) / Math.PI, 1);
/** An angle within half a turn of nought, rad. */
const wrapped = (rad) => rad - 2 * Math.PI * Math.round(rad / (2 * Math.PI));
/** Where a line of text stands: in heights of the text, which is larger on a small screen. */
const lineAt = (row) => `${1.5 + 1.35 * row}em`;
// A point at `length` from the joint, `angle` from the vertical, lower end forward positive; y upward.
const hanging = (length, angle) => [length * Math.sin(angle), -length * Math.cos(angle)];

/** Lengths of a vehicle, m, from its parameters; those of a spar are 0 without one. */
export function geometryOf(parameters) {
  const of = (table, name) => parameters.find((each) => each.table === table && each.name === name)?.value ?? 0;
  return {
    radius: of("body", "wheel_radius_m"),
    arm: of("body", "arm_length_m"),
    halfTrack: of("body", "half_track_m"),
    spar: of("spar", "spar_length_m"),
    motor: of("spar", "motor_distance_m"),
    ballast: of("spar", "ballast_distance_m"),
  };
}

export class SideView {
  constructor(svg) {
    this.svg = svg;
    this.middle = [320, 178];
    this.radiusPx = 118;
    this.earth = add(svg, "polygon", { class: "earth" });
    this.ground = add(svg, "polyline", { class: "ground" });
    this.plumb = add(svg, "line", { class: "plumb" });
    this.wheel = add(svg, "circle", { class: "wheel" });
    this.spokes = Array.from({ length: 5 }, () => add(svg, "line", { class: "spoke" }));
    this.arm = add(svg, "line", { class: "rod" });
    this.mass = add(svg, "circle", { class: "mass" });
    this.spar = add(svg, "line", { class: "spar" });
    this.swing = add(svg, "line", { class: "spar" });
    this.camera = add(svg, "rect", { class: "camera", width: 26, height: 18, x: -13, y: -9, rx: 3 });
    this.ballast = add(svg, "circle", { class: "ballast", r: 8 });
    this.hub = add(svg, "circle", { class: "mass", r: 6 });
    this.forces = Array.from({ length: 2 }, () => ({
      line: add(svg, "line", { class: "force" }),
      tip: add(svg, "polygon", { class: "tip" }),
    }));
    this.labels = Array.from({ length: 4 }, (_, row) => add(svg, "text", { x: 12, y: lineAt(row) }));
    this.notes = Array.from({ length: 4 }, (_, row) => add(svg, "text", { x: 628, y: lineAt(row), "text-anchor": "end" }));
  }

  /** `pose`: phi, spar, ballast, plane, distance; and of the simulation only: ground, spacing, height, and truth. */
  draw(geometry, pose) {
    const { radius } = geometry;
    const scale = this.radiusPx / radius;
    const at = ([x, y]) => [this.middle[0] + x * scale, this.middle[1] - y * scale];
    const line = (element, from, to) => {
      const [[x1, y1], [x2, y2]] = [at(from), at(to)];
      set(element, { x1, y1, x2, y2 });
    };
    const [sin, cos] = [Math.sin(pose.plane), Math.cos(pose.plane)];
    // A point `ahead` along the bare plane and `above` it, the axle at 0.
    const onPlane = (ahead, above) => [ahead * cos - above * sin, ahead * sin + above * cos];
    const heights = pose.ground ?? [0, 0, 0];
    const spacing = pose.ground ? pose.spacing : 4 * radius;
    const surface = heights.map((height, point) =>
      at(onPlane((point - (heights.length - 1) / 2) * spacing, height - (pose.height ?? 0) - radius)));
    this.ground.setAttribute("points", points(surface));
    this.earth.setAttribute("points", points([...surface, [surface.at(-1)[0], 600], [surface[0][0], 600]]));
    const [cx, cy] = this.middle;
    set(this.wheel, { cx, cy, r: this.radiusPx - 1.5 });
    set(this.hub, { cx, cy });
    const turned = pose.distance / radius;
    this.spokes.forEach((spoke, n) => {
      const angle = turned + (n * 2 * Math.PI) / 5;
      line(spoke, [0, 0], [0.93 * radius * Math.sin(angle), 0.93 * radius * Math.cos(angle)]);
    });
    line(this.plumb, [0, 0], [0, -1.25 * radius]);
    const mass = hanging(geometry.arm, pose.phi);
    line(this.arm, [0, 0], mass);
    const [mx, my] = at(mass);
    set(this.mass, { cx: mx, cy: my, r: 22 });
    const hasSpar = geometry.spar > 0;
    for (const element of [this.spar, this.swing, this.camera, this.ballast]) element.style.display = hasSpar ? "" : "none";
    if (hasSpar) {
      const motor = hanging(geometry.motor, pose.spar);
      const camera = hanging(-geometry.spar, pose.spar);
      const swing = hanging(geometry.ballast, pose.spar + pose.ballast);
      const ballast = [motor[0] + swing[0], motor[1] + swing[1]];
      line(this.spar, motor, camera);
      line(this.swing, motor, ballast);
      const [x, y] = at(camera);
      this.camera.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees(-pose.spar)})`);
      const [bx, by] = at(ballast);
      set(this.ballast, { cx: bx, cy: by });
    }
    this.tell(geometry, pose, hasSpar);
    this.drawForces(pose.truth, at, onPlane, radius);
  }

  tell(geometry, pose, hasSpar) {
    const texts = [
      `arm ${degrees(pose.phi)}°`,
      hasSpar ? `spar ${degrees(pose.spar)}°` : "",
      `slope ${degrees(pose.slope)}°`,
      `speed ${fixed(pose.speed, 2)} m/s`,
    ];
    texts.forEach((text, n) => (this.labels[n].textContent = text));
    const { truth } = pose;
    const sum = (pair) => pair[0] + pair[1];
    const slides = truth?.sliding.some(Boolean);
    const notes = truth
      ? [
          `load ${sum(truth.normal_n).toFixed(0)} N`,
          `force ${fixed(sum(truth.longitudinal_n), 0)} N`,
          slides ? `SLIDES ${Math.max(...truth.slip_m_s.map(Math.abs)).toFixed(2)} m/s` : "rolls",
          truth.lifted.some(Boolean) ? "OFF THE GROUND" : truth.chocked ? "chocked" : "",
        ]
      : ["", "", pose.sliding ? "SLIDES" : "", ""];
    notes.forEach((text, n) => (this.notes[n].textContent = text));
  }

  drawForces(truth, at, onPlane, radius) {
    // A force of this much is drawn as long as the radius.
    const full = 150;
    const arrow = ({ line, tip }, from, to) => {
      const [[x1, y1], [x2, y2]] = [at(from), at(to)];
      const length = Math.hypot(x2 - x1, y2 - y1);
      const shown = length > 4;
      line.style.display = tip.style.display = shown ? "" : "none";
      if (!shown) return;
      const [ux, uy] = [(x2 - x1) / length, (y2 - y1) / length];
      set(line, { x1, y1, x2: x2 - 6 * ux, y2: y2 - 6 * uy });
      tip.setAttribute("points", points([[x2, y2], [x2 - 11 * ux - 6 * uy, y2 - 11 * uy + 6 * ux], [x2 - 11 * ux + 6 * uy, y2 - 11 * uy - 6 * ux]]));
    };
    const [normal, along] = truth
      ? [truth.normal_n[0] + truth.normal_n[1], truth.longitudinal_n[0] + truth.longitudinal_n[1]]
      : [0, 0];
    const contact = onPlane(0, -radius);
    const below = onPlane(0, -radius - (Math.min(normal, 2 * full) / full) * radius * 0.35);
    arrow(this.forces[0], below, contact);
    arrow(this.forces[1], contact, onPlane((along / full) * radius, -radius));
  }
}

// Most points of a path that are drawn.
const PATH_MAX = 1500;

export class TopView {
  constructor(svg) {
    this.svg = svg;
    this.grid = add(svg, "path", { class: "grid" });
    this.true = add(svg, "polyline", { class: "true" });
    this.path = add(svg, "polyline", { class: "path" });
    this.vehicle = add(svg, "g");
    this.axle = add(this.vehicle, "line", { class: "axle" });
    this.tyres = Array.from({ length: 2 }, () => add(this.vehicle, "rect", { class: "tyre", rx: 2 }));
    this.nose = add(this.vehicle, "polygon", { class: "nose" });
    this.label = add(svg, "text", { x: 12, y: lineAt(0) });
    this.scaleLabel = add(svg, "text", { class: "note", x: 628, y: 368, "text-anchor": "end" });
    this.legend = add(svg, "text", { class: "note", x: 12, y: 368 });
    this.forget();
  }

  forget() {
    this.estimated = [];
    this.actual = [];
  }

  /** Adds a point of the estimated path, and of the true one if there is one. */
  add(estimated, actual) {
    const far = (list, point) => !list.length || Math.hypot(point[0] - list.at(-1)[0], point[1] - list.at(-1)[1]) > 0.02;
    if (far(this.estimated, estimated)) this.estimated.push(estimated);
    if (actual && far(this.actual, actual)) this.actual.push(actual);
    for (const list of [this.estimated, this.actual]) if (list.length > PATH_MAX) list.splice(0, list.length - PATH_MAX);
  }

  draw(geometry, pose) {
    const here = pose.truth ? [pose.truth.x_m, pose.truth.y_m] : [pose.x, pose.y];
    const all = [...this.estimated, ...this.actual, here];
    const reach = all.reduce((most, [x, y]) => Math.max(most, Math.abs(x - here[0]) / 1.6, Math.abs(y - here[1])), 0);
    const half = Math.min(Math.max(reach * 1.1, 4 * geometry.halfTrack, 1), 25);
    const scale = 165 / half;
    // Forward at boot is to the right, left is up.
    const at = ([x, y]) => [320 + (x - here[0]) * scale, 190 - (y - here[1]) * scale];
    const step = [0.25, 0.5, 1, 2, 5, 10].find((each) => each * scale > 45) ?? 20;
    let lines = "";
    for (let x = Math.ceil((here[0] - 320 / scale) / step) * step; x < here[0] + 320 / scale; x += step)
      lines += `M${at([x, 0])[0].toFixed(1)} 0V380`;
    for (let y = Math.ceil((here[1] - 190 / scale) / step) * step; y < here[1] + 190 / scale; y += step)
      lines += `M0 ${at([0, y])[1].toFixed(1)}H640`;
    this.grid.setAttribute("d", lines);
    this.path.setAttribute("points", points(this.estimated.map(at)));
    this.true.setAttribute("points", points(this.actual.map(at)));
    const [w, r] = [Math.max(geometry.halfTrack * scale, 9), Math.max(geometry.radius * scale, 7)];
    const [x, y] = at(here);
    const heading = pose.truth ? pose.truth.heading_rad : pose.heading;
    this.vehicle.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${degrees(-heading)})`);
    set(this.axle, { x1: 0, x2: 0, y1: -w, y2: w });
    this.tyres.forEach((tyre, n) => set(tyre, { x: -r, y: (n ? w : -w) - 4, width: 2 * r, height: 8 }));
    this.nose.setAttribute("points", points([[r * 0.9, -6], [r * 0.9 + 12, 0], [r * 0.9, 6]]));
    this.label.textContent = `x ${fixed(here[0], 2)} m, y ${fixed(here[1], 2)} m, heading ${degrees(wrapped(heading))}°`;
    this.scaleLabel.textContent = `grid ${step} m`;
    this.legend.textContent = pose.truth ? "solid: estimated; dashes and dots: true" : "estimated";
  }
}
