// Where scans and models come from: a server, or the page itself where it was written to one file.

const held = document.getElementById("gonio-held");
const inside = held ? JSON.parse(held.textContent) : null;

// Whether a server answers, which fits and exports.
export const served = !inside;

export const ended = "The server does not answer any more: start gonio view again.";
// Whether the page is a frame of a notebook, whose kernel fits.
export const notebook = Boolean(inside?.notebook);

async function asked(path, options) {
  const answer = await fetch(path, options).catch(() => {
    throw new Error(ended);
  });
  if (!answer.ok) {
    const said = await answer.json().catch(() => ({}));
    throw new Error(said.error || `${path}: the server answers ${answer.status}`);
  }
  return answer;
}

export async function session() {
  return inside ? inside.session : (await asked("/api/session")).json();
}

export async function columns(k) {
  const bytes = inside ? unpacked(inside.columns[k]) : await (await asked(`/api/set/${k}.bin`)).arrayBuffer();
  return decoded(bytes);
}

// The table of a scan, as numbers of single precision; null where the page is a file, which does not hold it.
export async function table(k) {
  return inside ? null : new Float32Array(await (await asked(`/api/set/${k}/table.bin`)).arrayBuffer());
}

// The functions of a model in double precision, with its declaration.
export function model(name) {
  return import(`model/${name}.js`);
}

export async function shader(name) {
  return inside ? inside.shaders[name] : (await asked(`/api/model/${name}.glsl`)).text();
}

export async function post(path, body) {
  if (inside) throw new Error("This page is a file: gonio view opens one that can do this.");
  const options = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  return asked(path, options);
}

export const get = (path) => asked(path);

export const remove = (path) => asked(path, { method: "DELETE" });

export async function upload(file) {
  const options = { method: "POST", headers: { "Content-Type": "application/octet-stream" }, body: file };
  return (await asked(`/api/upload?name=${encodeURIComponent(file.name)}`, options)).json();
}

// The second of two scans at the directions of the first.
export async function pair(first, second) {
  if (!inside) return (await asked(`/api/pair/${first}/${second}`)).json();
  const found = inside.pairs[`${first} ${second}`] ?? { error: "This file holds no comparison of these two scans: gonio view FILE FILE computes it." };
  if (found.error) throw new Error(found.error);
  return found;
}

function unpacked(text) {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
}

// A length, a header of that length, and columns of numbers.
function decoded(bytes) {
  const size = new DataView(bytes).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, size)));
  const found = {};
  for (const { name, offset, length } of header.arrays) found[name] = new Float64Array(bytes, 4 + size + offset, length);
  return { ...header, ...found };
}
