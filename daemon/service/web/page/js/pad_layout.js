// Positions of an array's taxels in its picture.

/** Rows and columns if the rig gives none: a square if possible, else the least oblong. */
function guess(count) {
  let rows = Math.floor(Math.sqrt(count));
  while (count % rows !== 0) rows -= 1;
  return { rows, columns: count / rows };
}

/** Position of each of `count` taxels as described by the rig: squares of side 1 in a picture of `width` x `height`. Several arrays are placed side by side. */
export function layout(count, shape) {
  if (shape?.arrays) return beside(shape.arrays.map((array) => layout(array.taxels, array.shape)));
  if (shape?.places?.length === count) return placed(shape.places.map(({ x_m, y_m }) => [1000 * x_m, 1000 * y_m]));
  const { rows, columns } = shape?.rows * shape?.columns === count ? shape : guess(count);
  const places = Array.from({ length: count }, (_, at) => [at % columns, Math.floor(at / columns)]);
  return { places, width: columns, height: rows };
}

function beside(layouts) {
  const gap = 0.5;
  let width = -gap;
  const places = layouts.flatMap((one) => {
    const left = width + gap;
    width = left + one.width;
    return one.places.map(([x, y]) => [left + x, y]);
  });
  return { places, width, height: Math.max(...layouts.map((one) => one.height)) };
}

/** Places in mm; a square is as wide as the distance of the nearest two. */
function placed(points) {
  let apart = Infinity;
  points.forEach(([x, y], i) => points.slice(0, i).forEach(([u, v]) => { apart = Math.min(apart, Math.hypot(x - u, y - v)); }));
  if (!(apart > 0 && Number.isFinite(apart))) apart = 1;
  const [left, low] = [0, 1].map((k) => Math.min(...points.map((point) => point[k])));
  const places = points.map(([x, y]) => [(x - left) / apart, (y - low) / apart]);
  const [width, height] = [0, 1].map((k) => 1 + Math.max(...places.map((place) => place[k])));
  return { places, width, height };
}
