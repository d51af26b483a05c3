// One loop for all animation: draws at most once per screen frame, and only on new samples.

const painters = [];

/** `paint` is called once per frame while the page is visible; it checks itself whether to draw. */
export function each_frame(paint) {
  painters.push(paint);
}

export function begin_frames() {
  const turn = () => {
    for (const paint of painters) paint();
    requestAnimationFrame(turn);
  };
  requestAnimationFrame(turn);
}

/** The theme's colour of this name, cached until the theme changes. */
const known = new Map();
export function colour(name) {
  if (!known.has(name)) known.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return known.get(name);
}

const themed = [];
/** Called when the theme has changed. */
export function on_theme(act) {
  themed.push(act);
}
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  known.clear();
  for (const act of themed) act();
});

/** A canvas at screen resolution; `context()` is scaled to CSS pixels, `resized` is true once after a change. */
export class Surface {
  constructor(canvas) {
    this.canvas = canvas;
    this.resized = true;
    this.width = 0;
    this.height = 0;
    new ResizeObserver(() => this.#fit()).observe(canvas);
    on_theme(() => { this.resized = true; });
  }

  #fit() {
    const scale = Math.min(devicePixelRatio || 1, 2);
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(this.width * scale);
    this.canvas.height = Math.round(this.height * scale);
    this.scale = scale;
    this.resized = true;
  }

  /** The cleared context; null while the canvas is not visible. */
  context() {
    if (this.width === 0 || this.height === 0) return null;
    this.resized = false;
    const context = this.canvas.getContext('2d');
    context.setTransform(this.scale, 0, 0, this.scale, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    return context;
  }
}
