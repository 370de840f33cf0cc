// A notebook's side of the page: it stands in a frame of its own, so that nothing of its style or scripts reaches the
// notebook, and what the frame draws with goes when the frame goes. Messages go between the frame and the kernel.

const FROM_PAGE = "gonio-page";
const TO_PAGE = "gonio-kernel";

function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  frame.title = "gonio: scan, model and sliders";
  frame.style.cssText = "display: block; width: 100%; height: 46rem; border: 0";

  const fromPage = (event) => {
    if (event.source !== frame.contentWindow || event.data?.gonio !== FROM_PAGE) return;
    model.send(event.data);
  };
  // The origin of a sandboxed frame has no name that could be given here.
  const toPage = (content) => frame.contentWindow?.postMessage({ ...content, gonio: TO_PAGE }, "*");

  window.addEventListener("message", fromPage);
  model.on("msg:custom", toPage);
  frame.srcdoc = model.get("_page");
  el.append(frame);
  return () => {
    window.removeEventListener("message", fromPage);
    model.off("msg:custom", toPage);
    frame.remove();
  };
}

export default { render };
