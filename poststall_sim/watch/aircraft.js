// Copyright 2026 the poststall_sim developers
// SPDX-License-Identifier: Apache-2.0

// The aircraft of the live page in three dimensions: attitude, lift, controls, where it came from.
'use strict';
const poststallAircraft = (colours, {clean, config, count, key}) => {
  const element = (id) => document.getElementById(id);
  const IDLE = '#A9CBE6', DOWNWARDS = '#731AA6', BODY = '#8A9099', MOVED = '#E3B23C';
  const channels = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const [idle, loaded, downwards] = [IDLE, colours.attached, DOWNWARDS].map(channels);
  function stripColour(cl, most, stalled) {
    if (stalled) return colours.stalled;
    const share = most > 0 ? Math.min(Math.abs(cl) / most, 1) : 0.5;
    const full = cl < 0 ? downwards : loaded;
    return 'rgb(' + idle.map((c, i) => Math.round(c + share * (full[i] - c))).join(',') + ')';
  }

  let size = 0, trail = [];
  // Points of base_link, one after the other, as they stand in the view; every few a gap.
  function placed(points, r, turn, gap) {
    const [x, y, z] = [[], [], []];
    for (let i = 0; i < points.length; i += 3) {
      const [a, b, c] = [points[i], points[i + 1], points[i + 2]];
      const [e, n] = turn(r[0] * a + r[1] * b + r[2] * c, r[3] * a + r[4] * b + r[5] * c);
      x.push(e); y.push(n); z.push(r[6] * a + r[7] * b + r[8] * c);
      if (gap && i % gap === gap - 3) { x.push(null); y.push(null); z.push(null); }
    }
    return [x, y, z];
  }
  function begin(shape) {
    const all = shape.body.concat(shape.strips);
    for (let i = 0; i < all.length; i += 3) {
      size = Math.max(size, 1.15 * Math.hypot(all[i], all[i + 1], all[i + 2]));
    }
    const side = {range: [-size, size], visible: false};
    const line = (colour, width, more) => ({type: 'scatter3d', mode: 'lines', x: [], y: [], z: [],
      hoverinfo: 'skip', line: {color: colour, width}, ...more});
    Plotly.newPlot('view', [
      {type: 'mesh3d', x: [], y: [], z: [], i: [], j: [], k: [], hoverinfo: 'skip',
        flatshading: true, lighting: {ambient: 0.8, diffuse: 0.35, specular: 0}},
      line(colours.ink, 3), line('#9AA1A9', 2), line('#9AA1A9', 3), line('#222222', 4)],
    clean({margin: {l: 0, r: 0, t: 0, b: 0}, scene: {xaxis: side, yaxis: side, zaxis: side,
      aspectmode: 'cube', dragmode: 'turntable', camera: {center: {x: 0, y: 0, z: 0.01},
        eye: {x: 0.4, y: -1.2, z: 0.5}}}}), config);
    element('view-hint').innerHTML =
      key(colours.attached, '\u25a0 lift, deeper towards its greatest') + ' ' +
      key(DOWNWARDS, '\u25a0 downwards') + ' ' +
      key(colours.stalled, '\u25a0 past its stall') + ' ' + key('#8C6D1F', '\u25a0 controls') +
      '. Ring: the horizon, long tick north. Black: where it flies to.';
  }
  function draw({state, shape, moving, setup}) {
    if (!state || !state.cl || !state.stalled) return;
    if (!shape || !moving) {
      element('view-hint').textContent = 'Waiting for the markers, of which the aircraft is ' +
        'drawn: they come at rates.views, while publish_markers is true.';
      return;
    }
    if (!size) begin(shape);
    const [s, c] = element('behind').checked ?
      [Math.sin(state.heading), Math.cos(state.heading)] : [0, 1];
    const turn = (e, n) => [e * c - n * s, e * s + n * c];
    const controls = moving.controls || [];
    const [x, y, z] = placed(
      [...shape.body, ...shape.strips, ...controls], state.attitude, turn);
    const faces = count(x.length / 3), most = setup.strips ? setup.strips.cl_max : [];
    const strips = state.cl.map((cl, i) => stripColour(cl, most[i], state.stalled[i] > 0.5));
    const facecolor = [...Array(shape.body.length / 9).fill(BODY),
      ...strips.flatMap((colour) => [colour, colour]), ...Array(controls.length / 9).fill(MOVED)];
    const lift = placed(moving.lift, state.attitude, turn, 6);
    const liftColours = strips.flatMap((colour) => [colour, colour, colour]);
    // The horizon, with a tick towards each quarter of the compass.
    const ring = count(73).map((i) => i * Math.PI / 36)
      .map((angle) => turn(size * Math.sin(angle), size * Math.cos(angle)));
    const tick = (i, inner) => [null, ring[18 * i], ring[18 * i].map((each) => inner * each)];
    const round = [...ring, ...tick(0, 0.7), ...[1, 2, 3].flatMap((i) => tick(i, 0.93))];
    const [east, north, up] = state.place;
    const path = trail.map(([e, n, u]) => [...turn(e - east, n - north), u - up])
      .filter((point) => Math.hypot(...point) < 1.2 * size);
    const speed = Math.hypot(...state.velocity) || 1;
    const way = [...turn(state.velocity[0], state.velocity[1]), state.velocity[2]]
      .map((each) => each / speed * size);
    const at = (points, i) => points.map((point) => point === null ? null : point[i]);
    Plotly.restyle('view', {
      x: [x, lift[0], at(round, 0), at(path, 0), [0, way[0]]],
      y: [y, lift[1], at(round, 1), at(path, 1), [0, way[1]]],
      z: [z, lift[2], round.map((point) => point === null ? null : 0), at(path, 2), [0, way[2]]],
      i: [faces.map((f) => 3 * f), null, null, null, null],
      j: [faces.map((f) => 3 * f + 1), null, null, null, null],
      k: [faces.map((f) => 3 * f + 2), null, null, null, null],
      facecolor: [facecolor, null, null, null, null],
      'line.color': [null, liftColours, '#9AA1A9', '#9AA1A9', '#222222']}, count(5));
  }

  // Remembers the way of the last moments.
  function follow(state) {
    const last = trail.length ? trail[trail.length - 1][3] : -Infinity;
    if (state.time < last) trail = [];
    if (state.time > last) trail = trail.slice(-100).concat([[...state.place, state.time]]);
  }

  // Another aircraft may be of another size.
  const forget = () => { size = 0; trail = []; };

  return {draw, follow, forget};
};
