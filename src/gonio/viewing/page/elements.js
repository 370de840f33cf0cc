// Elements in one line: element("button", {type: "button", onclick: ..}, "text", ..). Text is only ever text.

export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key in made) made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

export function choice(label, options, chosen, onchoose) {
  const select = element(
    "select",
    {},
    ...options.map(([value, text]) => element("option", { value, selected: value === chosen }, text)),
  );
  select.addEventListener("change", () => onchoose(select.value));
  return element("label", { className: "choice" }, element("span", {}, label), select);
}

// A few values of which one holds: radio buttons that look like one control.
export function oneOf(label, name, options, chosen, onchoose) {
  const group = element("fieldset", { className: "one-of" }, element("legend", {}, label));
  for (const [value, text, title = ""] of options) {
    const input = element("input", { type: "radio", name, value, checked: value === chosen });
    input.addEventListener("change", () => onchoose(value));
    group.append(element("label", { title }, input, element("span", {}, text)));
  }
  return group;
}

// Builds a part of the page anew: the control that had the focus there has it again, by its name.
export function anew(root, build) {
  const held = root.contains(document.activeElement) ? nameOf(document.activeElement) : "";
  build();
  if (!held || root.contains(document.activeElement)) return;
  const controls = [...root.querySelectorAll("button, input, select, summary")];
  controls.find((one) => nameOf(one) === held)?.focus({ preventScroll: true });
}

function nameOf(control) {
  const label = control.labels?.[0];
  return `${control.type} ${control.ariaLabel ?? (label?.querySelector("span") ?? label ?? control).textContent}`;
}
