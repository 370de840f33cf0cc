// The colours of the house: distinguishable to colour-blind readers (Okabe and Ito), lighter on a dark page.

const LIGHT = ["#0072B2", "#B34700", "#00785A", "#A4447C", "#8A6100", "#4A4A4A", "#7048B8"];
const DARK = ["#5EB5EE", "#F08A4B", "#3CC79E", "#E3A2C6", "#F0B93A", "#DDDDDD", "#B7A2FF"];

export const dark = window.matchMedia("(prefers-color-scheme: dark)");

export const colour = (k) => (dark.matches ? DARK : LIGHT)[k % LIGHT.length];

export const DASHES = [[], [8, 3], [3, 3], [8, 3, 2, 3]];

export const dashes = (k) => DASHES[Math.floor(k / LIGHT.length) % DASHES.length];

// A colour that the style sheet declares.
export const ofStyle = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
