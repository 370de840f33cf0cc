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
