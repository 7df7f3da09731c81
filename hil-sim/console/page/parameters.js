// Parameters: edited, compared, saved and loaded as a vehicle file.
import { tell } from "./panels.js";

const element = (id) => document.getElementById(id);

export class Parameters {
  constructor() {
    this.rows = [];
    /** Number to the text of its new value. */
    this.changes = new Map();
    this.link = null;
    element("filter").addEventListener("input", () => this.show());
    element("only-changed").addEventListener("click", ({ target }) => {
      target.setAttribute("aria-pressed", target.getAttribute("aria-pressed") !== "true");
      this.show();
    });
    element("store").addEventListener("click", () => this.store());
    element("discard").addEventListener("click", () => {
      this.changes.clear();
      this.show();
    });
    element("built-in").addEventListener("click", () => this.link?.builtIn());
    element("save").addEventListener("click", () => this.save());
    element("load").addEventListener("change", ({ target }) => this.load(target));
  }

  /** Shows the set in force of this link. */
  take(link) {
    this.link = link;
    this.rows = link.parameters() ?? [];
    this.changes.clear();
    this.show();
  }

  forget() {
    this.link = null;
    this.rows = [];
    this.changes.clear();
    element("parameters").hidden = true;
  }

  number(row, text) {
    const place = row.choices.indexOf(text);
    return place >= 0 ? place : Number(text);
  }

  show() {
    element("parameters").hidden = this.rows.length === 0;
    const filter = element("filter").value.toLowerCase();
    const onlyChanged = element("only-changed").getAttribute("aria-pressed") === "true";
    const table = document.createElement("table");
    table.innerHTML = "<thead><tr><th>Parameter</th><th>New value</th><th>In force</th><th class='limits'>Allowed</th><th class='limits'>Meaning</th></tr></thead>";
    const body = table.createTBody();
    for (const row of this.rows) {
      const name = `${row.table}.${row.name}`;
      const changed = this.changes.has(row.number);
      if (!name.toLowerCase().includes(filter) || (onlyChanged && !changed)) continue;
      body.append(this.line(row, name));
    }
    element("parameter-table").replaceChildren(table);
    this.count();
  }

  line(row, name) {
    const line = document.createElement("tr");
    const cell = (content, kind) => {
      const each = line.insertCell();
      if (kind) each.className = kind;
      each.append(content);
    };
    const text = this.changes.get(row.number) ?? row.text;
    let input;
    if (row.choices.length) {
      input = document.createElement("select");
      input.append(...row.choices.map((choice) => new Option(choice, choice, false, choice === text)));
    } else {
      input = document.createElement("input");
      input.type = "text";
      input.inputMode = "decimal";
      input.value = text;
    }
    input.setAttribute("aria-label", name);
    input.addEventListener("change", () => {
      const value = this.number(row, input.value);
      const good = Number.isFinite(value) && value >= row.min && value <= row.max && input.value.trim() !== "";
      input.setCustomValidity(good ? "" : `allowed is ${row.min} to ${row.max}`);
      if (!good) {
        input.reportValidity();
        tell(`${name} = ${input.value}: allowed is ${row.min} to ${row.max}`);
        return;
      }
      if (Math.fround(value) === row.value) this.changes.delete(row.number);
      else this.changes.set(row.number, input.value);
      line.className = this.changes.has(row.number) ? "changed" : "";
      this.count();
    });
    line.className = this.changes.has(row.number) ? "changed" : "";
    cell(name);
    cell(input);
    cell(row.text);
    cell(row.choices.length ? row.choices.join(", ") : `${row.min} to ${row.max}`, "limits quiet");
    cell(row.meaning, "limits quiet");
    return line;
  }

  count() {
    const n = this.changes.size;
    element("parameter-state").textContent = n ? `${n} changed, not stored` : `${this.rows.length} as in force`;
    element("store").disabled = element("discard").disabled = n === 0;
  }

  /** Shows how far the work on them is. */
  progress(share) {
    if (share != null) element("parameter-state").textContent = `the board works: ${Math.round(share * 100)} %`;
    else if (element("parameter-state").textContent.startsWith("the board works")) this.count();
  }

  store() {
    const row = (number) => this.rows.find((each) => each.number === number);
    const list = [...this.changes].map(([number, text]) => [number, this.number(row(number), text)]);
    const error = this.link?.change(list);
    if (error) tell(error);
  }

  save() {
    download(this.link.vehicleFile(), "vehicle.toml", "application/toml");
  }

  async load(input) {
    const file = input.files[0];
    input.value = "";
    if (!file || !this.link) return;
    const { error, differences } = this.link.compare(await file.text());
    if (error) {
      tell(error);
      return;
    }
    this.changes.clear();
    for (const [number, value] of differences) {
      const { choices } = this.rows.find((each) => each.number === number);
      this.changes.set(number, choices.length ? choices[value] : String(value));
    }
    element("only-changed").setAttribute("aria-pressed", "true");
    this.show();
    tell(`${file.name}: ${differences.length} parameters differ from the set in force; nothing is stored yet`);
  }
}

/** Offers bytes or text as a file. */
export function download(content, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
