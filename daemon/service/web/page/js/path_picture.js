// The path of an exploration on the plate, as a picture.
const ns = 'http://www.w3.org/2000/svg';

function shape(tag, attributes) {
  const made = document.createElementNS(ns, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

const mm = ({ x_m, y_m }) => [1000 * x_m, 1000 * y_m];

/** Start of an exploration of recipe.plan and the corners of its stroke, on the plate [mm]. */
export function path_mm(exploration) {
  const [u, v] = mm(exploration.start);
  const corners = exploration.phases.find((phase) => phase.corners)?.corners ?? [];
  return [[u, v], ...corners.map(mm).map(([along, across]) => [u + along, v + across])];
}

/** `description`: from rig.describe; the plate is drawn if it is known. */
export function path_picture(exploration, description) {
  const size = description ? mm(description.plate.size) : [150, 150];
  const foot = description ? mm(description.footprint) : [16, 16];
  const points = path_mm(exploration).map(([u, v]) => [u, size[1] - v]); // the weft upwards
  const svg = shape('svg', { viewBox: `-4 -4 ${size[0] + 8} ${size[1] + 8}`, class: 'path', role: 'img', 'aria-label': `Path of ${exploration.exploration} on the plate` });
  svg.append(shape('rect', { x: 0, y: 0, width: size[0], height: size[1], class: 'plate' }));
  svg.append(shape('rect', { x: points[0][0] - foot[0] / 2, y: points[0][1] - foot[1] / 2, width: foot[0], height: foot[1], class: 'foot' }));
  svg.append(shape('polyline', { points: points.map((point) => point.join(',')).join(' '), class: 'way' }));
  const [x, y] = points.at(-1);
  svg.append(shape('circle', { cx: x, cy: y, r: 3, class: 'end' }));
  return svg;
}
