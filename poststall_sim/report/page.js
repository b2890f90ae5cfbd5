// Copyright 2026 the poststall_sim developers
// SPDX-License-Identifier: Apache-2.0

// What the page does: draws the data that stands beside it, and moves it with the slider.
'use strict';
(() => {
  const page = JSON.parse(document.getElementById('data').textContent);
  const {colours, strips, view} = page;
  const {narrow, touch, font, config, grid, axis, clean, count, key, fixed, ...shared} =
    poststallFigures(colours);
  const element = (id) => document.getElementById(id);
  const drawn = [];   // one function for each figure that follows the slider

  // Attached, or from a light to a full colour of stall with the share of the wing.
  const channels = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  function shareColour(share) {
    if (!(share > 0)) return colours.attached;
    const least = channels(colours.partly), full = channels(colours.stalled);
    return 'rgb(' + least.map((c, i) => Math.round(c + share * (full[i] - c))).join(',') + ')';
  }

  const {legend, small, surfaceTrace} = shared.ofStrips(strips);
  const cut = (values, groups) => groups.map((group) => values.slice(group.begin, group.end));
  const marked = (frame, groups) => shared.marked(strips.cl[frame], strips.stalled === null ?
    null : [...strips.stalled[frame]].map((each) => each === '1'), groups);

  function drawLoading() {
    const groups = shared.drawLoading(strips, page.averaged);
    drawn.push((frame) => Plotly.restyle('loading', marked(frame, groups), count(groups.length)));
  }

  function drawPoints() {
    const groups = strips.groups;
    const lines = page.curves.map((curve) => ({type: 'scatter', mode: 'lines', x: curve.alpha,
      y: curve.cl, hoverinfo: 'skip', line: {color: curve.wing ? '#6B7178' : '#C3C8CE',
        width: curve.wing ? 2 : 1.5, dash: curve.wing ? 'solid' : 'dot'}}));
    const traces = groups.map((group, number) => surfaceTrace(group, number, {mode: 'markers',
      hovertemplate: group.name + ': %{x:.1f}\u00b0, cl %{y:.3f}<extra></extra>'}));
    const all = strips.angle.flat();
    const low = all.reduce((a, b) => Math.min(a, b)), high = all.reduce((a, b) => Math.max(a, b));
    const [bottom, top] = strips.range;
    element('points-hint').innerHTML = legend + small(groups);
    if (page.curves.length) {
      element('points-hint').append(' Lines: section curves, ' + page.curves.map(
        (curve) => curve.name + (curve.wing ? '' : ' (dotted)')).join(', ') + '.',
        page.averaged ? ' Stalled strips may stand off their curve: it is asked of the mean ' +
          'over about a chord of the span (ell), not of each strip.' : '');
    }
    Plotly.newPlot('points', [...lines, ...traces], clean({
      margin: {l: 48, r: 10, t: 8, b: 42}, dragmode: false,
      xaxis: axis('angle at which the section works [deg]',
        {range: [low - 2, high + 2], fixedrange: true}),
      yaxis: axis('strip cl [-]', {range: [bottom, top], fixedrange: true})}), config);
    drawn.push((frame) => Plotly.restyle('points', {x: cut(strips.angle[frame], groups),
      ...marked(frame, groups)}, count(groups.length).map((n) => lines.length + n)));
  }

  // The aircraft's triangles where it is at an instant, in map.
  function placed(frame) {
    const [x, y, z] = [[], [], []], p = view.position[frame], r = view.attitude[frame];
    for (const corner of view.corners) {
      const [a, b, c] = corner.map((value) => value * view.scale);
      x.push(p[0] + r[0] * a + r[1] * b + r[2] * c);
      y.push(p[1] + r[3] * a + r[4] * b + r[5] * c);
      z.push(p[2] + r[6] * a + r[7] * b + r[8] * c);
    }
    return {x, y, z};
  }

  function mesh(frames, opacity) {
    const each = frames.map(placed), corners = view.corners.length, faces = corners / 3;
    const joined = (key) => each.flatMap((one) => one[key]);
    const all = count(frames.length * faces);
    return {type: 'mesh3d', x: joined('x'), y: joined('y'), z: joined('z'),
      i: all.map((f) => 3 * f), j: all.map((f) => 3 * f + 1), k: all.map((f) => 3 * f + 2),
      facecolor: frames.flatMap((f) => Array(faces).fill(shareColour(view.frame_share[f]))),
      opacity, hoverinfo: 'skip',
      flatshading: true, lighting: {ambient: 0.75, diffuse: 0.4, specular: 0}};
  }

  // From where and whither to look so that the box just fits, its labels too: the library's
  // camera opens 45 degrees from top to bottom.
  function camera(ratio) {
    const frame = element('view').getBoundingClientRect(), towards = view.camera;
    const flat = Math.hypot(towards[0], towards[1]);
    const right = [-towards[1] / flat, towards[0] / flat, 0];
    const above = [-towards[2] * right[1], towards[2] * right[0], flat];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const tall = Math.tan(Math.PI / 8), wide = tall * frame.width / frame.height;
    const corners = count(8).map((n) => ratio.map((value, i) => (n >> i & 1 ? 0.5 : -0.5) * value));
    let centre = [0, 0, 0], away = 3;
    for (let turn = 0; turn < 8; turn++) {
      const seen = [[right, wide], [above, tall]].map(([axis, opening]) => {
        const places = corners.map((corner) => {
          const from = corner.map((value, i) => value - centre[i]);
          return dot(from, axis) / (opening * (away - dot(from, towards)));
        });
        return [Math.min(...places), Math.max(...places)];
      });
      const shift = seen.map(([low, high], k) => 0.5 * (low + high) * away * [wide, tall][k]);
      centre = centre.map((value, i) => value + shift[0] * right[i] + shift[1] * above[i]);
      away *= Math.max((seen[0][1] - seen[0][0]) / (narrow ? 1.4 : 1.56),
        (seen[1][1] - seen[1][0]) / (narrow ? 1.45 : 1.75));
    }
    const vector = ([x, y, z]) => ({x, y, z});
    return {center: vector(centre),
      eye: vector(towards.map((value, i) => centre[i] + away * value))};
  }

  // Round numbers between two, about so many: of the altitude none at the foot of its axis, where
  // the first of the ground stands.
  function ticks(low, high, about) {
    const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
    const first = Math.ceil(low / step);
    return count(Math.floor(high / step) - first + 1)
      .map((n) => Number(((first + n) * step).toPrecision(12)));
  }

  function drawView() {
    const [x, y, z] = view.path, low = view.low, high = view.high;
    const size = high.map((value, i) => value - low[i]), longest = Math.max(...size);
    const traces = [
      {type: 'scatter3d', mode: 'lines', x, y, z: z.map(() => low[2]), hoverinfo: 'skip',
        line: {color: '#B4B9C0', width: 2}},
      {type: 'scatter3d', mode: 'lines', x, y, z, hoverinfo: 'skip',
        line: {color: view.share.map(shareColour), width: 4}},
      mesh(view.ghosts, 0.35), mesh([0], 1)];
    const ratio = size.map((value) => value / longest);
    const side = (title, i) => ({title: {text: title, font: {size: font.size}}, range: [low[i], high[i]], ...grid,
      backgroundcolor: '#F7F8F9', showbackground: i === 2, tickfont: {size: 10}, nticks: narrow ? 4 : 7});
    Plotly.newPlot('view', traces, clean({margin: {l: 0, r: 0, t: 0, b: 0}, scene: {
      xaxis: side(narrow ? 'E [m]' : 'east [m]', 0),
      yaxis: side(narrow ? 'N [m]' : 'north [m]', 1),
      zaxis: {...side(narrow ? '' : 'altitude [m]', 2), tickmode: 'array',
        tickvals: ticks(low[2] + 0.1 * size[2], high[2], narrow ? 4 : 6)},
      aspectmode: 'manual', dragmode: 'turntable',
      aspectratio: {x: ratio[0], y: ratio[1], z: ratio[2]},
      camera: camera(ratio)}}), config);
    element('view-hint').textContent = 'Equal scales' + (view.scale > 1 ?
      ', the aircraft drawn ' + view.scale + ' times its size' : '') +
      '. Blue: attached, orange: wing stalled; grey: the path on the ground plane.' + (narrow ? ' Upright: altitude [m].' : '');
    drawn.push((frame) => {
      const at = placed(frame);
      const colour = Array(view.corners.length / 3).fill(shareColour(view.frame_share[frame]));
      Plotly.restyle('view', {x: [at.x], y: [at.y], z: [at.z], facecolor: [colour]}, 3);
    });
  }

  const slider = element('slider');
  function drawHistories() {
    const panels = page.panels, n = panels.length, row = 1 / (1.35 * n - 0.35);
    const layout = clean({margin: {l: 52, r: 10, t: 24, b: 42}, height: 62 + 112 * n,
      dragmode: touch ? false : 'zoom', hovermode: 'x', annotations: [], shapes: []});
    const traces = [];
    panels.forEach((panel, k) => {
      const tail = k ? String(k + 1) : '', top = 1 - 1.35 * row * k;
      layout['yaxis' + tail] = axis('', {domain: [Math.max(top - row, 0), top], fixedrange: true,
        nticks: 5, anchor: 'x' + tail});
      layout['xaxis' + tail] = axis(k === n - 1 ? page.axis.label + ' [' + page.axis.unit + ']' : '',
        {anchor: 'y' + tail, showticklabels: k === n - 1, ...(k ? {matches: 'x'} : {})});
      const own = panel.lines.filter((line) => !line.command);
      const names = own.map((line) => key(line.colour, '\u2014 ' + line.name)).join(' ');
      layout.annotations.push({text: '<b>' + panel.title + '</b> [' + panel.unit + '] ' +
        (own.length > 1 ? names : ''), showarrow: false, xref: 'paper', yref: 'paper',
        x: 0, y: top, xanchor: 'left', yanchor: 'bottom', font: {size: font.size}});
      panel.lines.forEach((line) => traces.push({type: 'scatter', name: line.name, x: page.x,
        y: line.values, xaxis: 'x' + tail, yaxis: 'y' + tail,
        mode: page.points ? 'lines+markers' : 'lines', marker: {size: 5},
        line: {color: line.colour, width: line.command ? 4 : 1.6},
        hovertemplate: line.name + ' %{y:.4~g}<extra></extra>'}));
    });
    const whole = {xref: 'x', yref: 'paper', y0: 0, y1: 1};
    layout.shapes = page.shaded.map(([x0, x1]) => ({type: 'rect', ...whole, x0, x1,
      layer: 'below', fillcolor: colours.stalled, opacity: 0.08, line: {width: 0}}));
    Plotly.newPlot('histories', traces, layout, config);
    element('histories').on('plotly_click', (event) => {
      const point = event.points[0];
      show(page.points ? point.pointIndex : nearest(point.x));   // up and down pass an angle twice
    });
    element('histories-title').textContent = page.points ? 'Coefficients' : 'Time histories';
    element('histories-hint').textContent = (touch ? 'A tap' :
      'Drag to zoom all of them, double-click to see the whole again; a click') +
      ' goes there.' + (page.shaded.length ? ' Shaded: wing stalled, darker where half of it is.' :
        '') + (panels.some((panel) => panel.lines.some((line) => line.command)) ?
        ' Broad and pale: what was commanded.' : '');
    // A line of our own: to move a shape of the library's takes longer than all else together.
    const line = element('instant');
    function point() {
      const {xaxis, height, margin} = element('histories')._fullLayout;
      const x = xaxis.d2p(page.frames[Number(slider.value)]);
      line.hidden = x < 0 || x > xaxis._length;
      line.style.left = xaxis._offset + x + 'px';
      line.style.top = margin.t + 'px';
      line.style.height = height - margin.t - margin.b + 'px';
    }
    element('histories').on('plotly_afterplot', point);
    drawn.push(point);
  }

  function nearest(x) {
    let best = 0;
    page.frames.forEach((value, i) => {
      if (Math.abs(value - x) < Math.abs(page.frames[best] - x)) best = i;
    });
    return best;
  }

  // Shows an instant; figures are drawn at most once for each frame of the screen.
  let shown = -1, due = false;
  const last = page.frames.length - 1;
  function show(frame) {
    slider.value = Math.min(Math.max(Math.round(frame), 0), last);
    if (!due) {
      due = true;
      requestAnimationFrame(draw);
    }
  }
  function draw() {
    due = false;
    const frame = Number(slider.value);
    if (frame === shown) return;
    shown = frame;
    drawn.forEach((each) => each(frame));
    const {symbol, unit, digits} = page.axis;
    const space = unit === 'deg' ? '\u00b0' : ' ' + unit;
    const said = [[symbol, fixed(page.frames[frame], digits) + space],
      ...page.readouts.map((each) => [each.label,
        each.values[frame] === null ? '-' : fixed(each.values[frame], each.digits) + each.unit])];
    element('readouts').replaceChildren(...said.map(([label, value]) => {
      const span = document.createElement('span'), name = document.createElement('i');
      const number = document.createElement('b');
      name.textContent = label + ' ';
      number.textContent = value;
      span.append(name, number);
      return span;
    }));
    slider.setAttribute('aria-valuetext', said[0].join(' '));
  }

  let playing = null;   // when and from which frame
  function play(on) {
    const frame = Number(slider.value) === last ? 0 : Number(slider.value);
    playing = on ? {since: performance.now(), frame} : null;
    element('play').textContent = on ? '\u23f8\ufe0e' : '\u25b6\ufe0e';
    element('play').setAttribute('aria-label', on ? 'pause' : 'play');
    if (on) requestAnimationFrame(tick);
  }
  function tick(now) {
    if (playing === null) return;
    const frame = playing.frame + page.rate * (now - playing.since) / 1000;
    show(frame);
    if (frame >= last) play(false);
    else requestAnimationFrame(tick);
  }

  slider.max = last;
  slider.addEventListener('input', () => { play(false); show(Number(slider.value)); });
  element('play').addEventListener('click', () => play(playing === null));
  element('events').addEventListener('click', (event) => {
    const button = event.target.closest('button');
    if (button) { play(false); show(Number(button.dataset.frame)); }
  });
  document.addEventListener('keydown', (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const way = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (way) {
      play(false);
      show(Number(slider.value) + way * (event.shiftKey ? 10 : 1));
    } else if (event.key === ' ' && event.target.tagName !== 'BUTTON') {
      play(playing === null);
    } else {
      return;
    }
    event.preventDefault();
  });

  const figures = [['view-box', view !== null, drawView],
    ['loading-box', strips !== null, drawLoading],
    ['points-box', strips !== null && strips.angle !== null, drawPoints],
    ['histories-box', page.panels.length > 0, drawHistories]];
  element('main').className = page.points ? 'polar' : strips === null ? 'bare' : '';
  figures.forEach(([id, possible]) => { element(id).hidden = !possible; });
  figures.forEach(([, possible, make]) => { if (possible) make(); });
  element('notes').hidden = !element('notes').children.length;
  show(page.first);
})();
