// Colours that canvases draw with; the rest of the page has them from studio.css.

export const INK = {
  back: "#121315",
  grid: "rgba(255,255,255,0.07)",
  line: "rgba(255,255,255,0.16)",
  text: "#8f959d",
  bright: "#e6e8eb",
  ridge: "#ffb454",
  valley: "#6fc3ff",
  other: "rgba(255,255,255,0.55)",
  fault: "#ff6b6b",
  pin: "#58d6a9",
} as const;

export const FONT = "11px system-ui, sans-serif";
