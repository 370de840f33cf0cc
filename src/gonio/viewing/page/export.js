// Out of the page: values, numbers, figures and files for other programs.

import { ofStyle } from "gonio/colours.js";
import { element } from "gonio/elements.js";
import { asCommand, asCsv, asJson, asToml } from "gonio/exported.js";
import { button, sent, WHY_NOT } from "gonio/fit.js";
import { get, post, served } from "gonio/source.js";
import { printable } from "gonio/words.js";

const FIGURES = ["svg", "pdf", "png"];

export function mount(store) {
  const said = element("p", { className: "note", role: "status" });
  const wrong = element("p", { className: "error", role: "alert" });
  const close = button("Close", "Close this list", () => dialog.close());
  const figure = element("select", { ariaLabel: "format of the figure" }, ...FIGURES.map((kind) => element("option", { value: kind }, kind.toUpperCase())));
  const target = element("select", { ariaLabel: "program" });
  const scale = element("input", { type: "text", inputMode: "decimal", className: "number", size: 6 });
  const scaled = element("label", { hidden: true }, element("span", {}, "1/sr of one unit of these relative data "), scale);
  const draw = button("Draw figure", "gonio draws the curves that are shown", () => act(drawn));
  const write = button("Download", "The values for that program", () => act(written));
  const row = (title, ...controls) => element("div", { className: "export" }, element("h3", {}, title), element("div", { className: "buttons" }, ...controls));
  const file = (label, title, name, text, kind) =>
    button(label, title, () => act((state) => (download(stem(state) + name, text(state), kind), `${stem(state)}${name} was handed to the browser.`)));
  const dialog = element(
    "dialog",
    { className: "exports", ariaLabel: "Export" },
    element("h2", {}, "Export"),
    row(
      "Values of the curve that is shown",
      file("JSON", "Values by name, for gonio eval MODEL --set FILE.json", "-values.json", asJson, "application/json"),
      file("TOML", "Values by name, of every incidence angle", "-values.toml", asToml, "application/toml"),
      button("Copy command", "gonio eval with these values", () => act(copied)),
    ),
    row("Numbers", file("CSV", "Measured and modelled values of the curves that are shown", ".csv", asCsv, "text/csv")),
    row("Figure", button("Plot as PNG", "The plot as it is on the page", () => act(plotted)), figure, draw),
    row("Another program", target, write, scaled),
    said,
    wrong,
    close,
  );
  document.body.append(dialog);
  document.querySelector("#top .actions").append(button("Export", "Values, numbers, figures, other programs", open));
  if (!served) for (const control of [figure, draw, target, write]) Object.assign(control, { disabled: true, title: WHY_NOT });

  async function open() {
    said.textContent = served ? "" : `Figures and other programs: ${WHY_NOT}`;
    wrong.textContent = "";
    const state = store.get();
    scaled.hidden = !(served && state.sets[state.set].relative);
    dialog.showModal();
    if (!served || target.options.length) return;
    await act(async () => {
      const found = await (await get("/api/targets")).json();
      target.append(...found.map((one) => element("option", { value: one.name, disabled: Boolean(one.refused), title: one.refused || one.writes }, `${one.title}: ${one.writes}`)));
      target.value = "python";
      return "";
    });
  }

  async function act(what) {
    said.textContent = wrong.textContent = "";
    try {
      said.textContent = printable((await what(store.get())) ?? "");
    } catch (error) {
      wrong.textContent = printable(error.message ?? error);
    }
  }

  async function drawn(state) {
    const cells = state.sets[state.set].cells.map((_, k) => k).filter((k) => !state.hidden.has(k));
    said.textContent = "Drawing …";
    const asked = { ...sent(state), cells, format: figure.value, scale: state.scale };
    return `Written: ${(await (await post("/api/export/figure", asked)).json()).written}`;
  }

  async function written(state) {
    const asked = { ...sent(state), target: target.value };
    if (!scaled.hidden && scale.value.trim()) asked.scale = Number(scale.value.replace(",", "."));
    said.textContent = "Writing …";
    const found = await (await post("/api/export/target", asked)).json();
    for (const [name, text] of Object.entries(found.files)) download(name, Uint8Array.from(atob(text), (c) => c.charCodeAt(0)), "application/octet-stream");
    return [`${Object.keys(found.files).join(", ")} for ${found.target}.`, ...found.remarks].join(" ");
  }

  async function copied(state) {
    const command = asCommand(state);
    await navigator.clipboard?.writeText(command).catch(() => {});
    return command;
  }
}

const stem = (state) => `${printable(state.sets[state.set].name).replace(/\.\w+$/, "").replace(/[^\w.-]+/g, "-").slice(0, 60) || "scan"}-${state.model.declaration.name}`;

// Hands a file to the browser.
export function download(name, content, type) {
  const address = URL.createObjectURL(new Blob([content], { type }));
  const link = element("a", { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// All plots of curves, one below the other, as they are.
export async function plotted(state) {
  const drawn = [...document.querySelectorAll("#curves .plot:not([hidden]) canvas")];
  if (!drawn.length) throw new Error("No curve is shown.");
  const whole = element("canvas", { width: Math.max(...drawn.map((c) => c.width)), height: drawn.reduce((sum, c) => sum + c.height, 0) });
  const ctx = whole.getContext("2d");
  ctx.fillStyle = ofStyle("paper");
  ctx.fillRect(0, 0, whole.width, whole.height);
  let top = 0;
  for (const one of drawn) {
    ctx.drawImage(one, 0, top);
    top += one.height;
  }
  const blob = await new Promise((resolve) => whole.toBlob(resolve, "image/png"));
  download(`${stem(state)}.png`, blob, "image/png");
  return `${stem(state)}.png was handed to the browser.`;
}
