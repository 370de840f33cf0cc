// A file that is opened on the page: chosen, or dropped anywhere; the server reads it, and it is one scan more.

import { element } from "gonio/elements.js";
import { button, WHY_NOT } from "gonio/fit.js";
import { served, upload } from "gonio/source.js";
import { printable } from "gonio/words.js";

export function mount(panel, store, actions) {
  const input = element("input", { type: "file", hidden: true, ariaLabel: "file of a scan" });
  const open = button("Open a scan …", "A file of any format that gonio reads; or drop it on the page", () => input.click());
  const said = element("p", { className: "note", role: "status" });
  const wrong = element("p", { className: "error", role: "alert" });
  panel.append(element("section", { className: "files" }, element("h2", {}, "Another scan"), element("div", { className: "buttons" }, open), input, said, wrong));
  if (!served) {
    open.disabled = true;
    said.textContent = WHY_NOT;
    return;
  }
  said.textContent = "It is shown here, and can be compared with the first.";

  async function take(file) {
    wrong.textContent = "";
    const limit = store.get().uploadLimit;
    if (file.size > limit) {
      wrong.textContent = printable(`${file.name}: larger than ${Math.round(limit / 2 ** 20)} MB; gonio view --upload-limit allows more`);
      return;
    }
    said.textContent = printable(`Reading ${file.name} …`);
    open.disabled = true;
    try {
      const { place, set } = await upload(file);
      const sets = store.get().sets.slice();
      sets[place] = set;
      store.get().sets = sets;
      await actions.chooseSet(place);
      store.set({ sets: sets.slice() });
      said.textContent = printable(`${set.name} is open.`);
      actions.begin();
    } catch (error) {
      said.textContent = "";
      wrong.textContent = printable(error.message);
    }
    open.disabled = false;
  }

  input.addEventListener("change", () => {
    if (input.files[0]) take(input.files[0]);
    input.value = "";
  });
  const isFile = (event) => event.dataTransfer?.types.includes("Files");
  document.addEventListener("dragover", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  document.addEventListener("dragleave", (event) => event.relatedTarget ?? document.body.classList.remove("dropping"));
  document.addEventListener("drop", (event) => {
    document.body.classList.remove("dropping");
    if (!isFile(event)) return;
    event.preventDefault();
    take(event.dataTransfer.files[0]);
  });
}
