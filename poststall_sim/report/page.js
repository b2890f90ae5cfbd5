// Copyright 2026 the poststall_sim developers
// SPDX-License-Identifier: Apache-2.0

// What the page does: draws the data that stands beside it, and moves it with the slider.
'use strict';
(() => {
  const page = JSON.parse(document.getElementById('data').textContent);
  const {colours, strips, view} = page;
  const element = (id) => document.getElementById(id);
  const narrow = window.matchMedia('(max-width: 700px)').matches;
  const touch = window.matchMedia('(pointer: coarse)').matches;
  const font = {family: 'system-ui, sans-serif', size: narrow ? 11 : 12, color: colours.ink};
  const config = {displaylogo: false, responsive: true, displayModeBar: touch ? false : 'hover',
    modeBarButtonsToRemove: ['select2d', 'lasso2d', 'autoScale2d', 'tableRotation',
      'resetCameraLastSave3d']};
  const shares = [[0, colours.attached], [0.001, colours.partly], [1, colours.stalled]];
  const grid = {gridcolor: '#E6E8EB', zerolinecolor: '#B9BEC5', linecolor: '#8A9099'};
  const drawn = [];   // one function for each figure that follows the slider

  const axis = (title, more) => ({title: {text: title, standoff: 6}, ...grid, ...more});
  const clean = (layout) => ({font, paper_bgcolor: '#fff', plot_bgcolor: '#fff',
    showlegend: false, ...layout});

  // The colour and the sign of each strip of a surface at an instant.
  const isStalled = (frame, group) => strips.stalled === null ? [] :
    [...strips.stalled[frame].slice(group.begin, group.end)].map((each) => each === '1');
  const markers = (frame, group) => {
    const stalled = isStalled(frame, group);
    const cut = strips.cl[frame].slice(group.begin, group.end);
    return {
      'marker.color': [cut.map((_, i) => stalled[i] ? colours.stalled : colours.attached)],
      'marker.symbol': [cut.map((_, i) => stalled[i] ? 'triangle-down' : 'circle')]};
  };
  const surfaceTrace = (group, number, more) => ({type: 'scatter', name: group.name, x: [], y: [],
    marker: {size: number ? 6 : 9, opacity: number ? 0.6 : 1, line: {width: 0}}, ...more});
  const legend = '<span style="color:' + colours.attached + '">\u25cf attached</span>  ' +
    '<span style="color:' + colours.stalled + '">\u25bc past its stall</span>';
  const note = (text, more) => ({text, showarrow: false, xref: 'paper', yref: 'paper', x: 0, y: 1,
    xanchor: 'left', yanchor: 'bottom', font: {size: font.size}, ...more});

  function drawLoading() {
    const groups = strips.groups.filter((group) => !group.upright);
    const traces = groups.map((group, number) => surfaceTrace(group, number, {
      mode: 'lines+markers', x: strips.y.slice(group.begin, group.end),
      line: {color: '#9AA1A9', width: number ? 1 : 1.5},
      hovertemplate: group.name + ', y %{x:.2f} m: cl %{y:.3f}<extra></extra>'}));
    const wing = strips.groups[0];
    if (strips.cl_max !== null) {
      traces.push({type: 'scatter', mode: 'lines', x: strips.y.slice(wing.begin, wing.end),
        y: strips.cl_max.slice(wing.begin, wing.end), hoverinfo: 'skip',
        line: {color: colours.limit, width: 1.5, dash: 'dash'}});
    }
    const half = 1.06 * Math.max(...strips.y.slice(wing.begin, wing.end).map(Math.abs));
    const said = legend + (strips.cl_max === null ? '' :
      '  <span style="color:' + colours.limit + '">- - greatest of the section</span>');
    Plotly.newPlot('loading', traces, clean({
      margin: {l: 48, r: 10, t: 24, b: 42}, dragmode: false, annotations: [note(said)],
      xaxis: axis('y [m], port on the left', {range: [half, -half], fixedrange: true}),
      yaxis: axis('strip cl [-]', {range: strips.range, fixedrange: true})}), config);
    drawn.push((frame) => groups.forEach((group, number) => Plotly.restyle('loading', {
      y: [strips.cl[frame].slice(group.begin, group.end)], ...markers(frame, group)}, number)));
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
    const said = legend + (page.curves.length ? '  lines: section curves, ' +
      page.curves.map((curve) => curve.name + (curve.wing ? '' : ' (dotted)')).join(', ') : '');
    Plotly.newPlot('points', [...lines, ...traces], clean({
      margin: {l: 48, r: 10, t: 24, b: 42}, dragmode: false, annotations: [note(said)],
      xaxis: axis('angle at which the section works [deg]',
        {range: [low - 2, high + 2], fixedrange: true}),
      yaxis: axis('strip cl [-]', {range: [bottom, top], fixedrange: true})}), config);
    drawn.push((frame) => groups.forEach((group, number) => Plotly.restyle('points', {
      x: [strips.angle[frame].slice(group.begin, group.end)],
      y: [strips.cl[frame].slice(group.begin, group.end)],
      ...markers(frame, group)}, lines.length + number)));
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

  const count = (n) => Array.from({length: n}, (_, i) => i);
  function mesh(frames, opacity) {
    const each = frames.map(placed), corners = view.corners.length, faces = corners / 3;
    const joined = (key) => each.flatMap((one) => one[key]);
    const all = count(frames.length * faces);
    return {type: 'mesh3d', x: joined('x'), y: joined('y'), z: joined('z'),
      i: all.map((f) => 3 * f), j: all.map((f) => 3 * f + 1), k: all.map((f) => 3 * f + 2),
      intensity: frames.flatMap((f) => Array(corners).fill(view.frame_share[f])),
      colorscale: shares, cmin: 0, cmax: 1, showscale: false, opacity, hoverinfo: 'skip',
      flatshading: true, lighting: {ambient: 0.75, diffuse: 0.4, specular: 0}};
  }

  function drawView() {
    const [x, y, z] = view.path, low = view.low, high = view.high;
    const size = high.map((value, i) => value - low[i]), longest = Math.max(...size);
    const traces = [
      {type: 'scatter3d', mode: 'lines', x, y, z: z.map(() => low[2]), hoverinfo: 'skip',
        line: {color: '#B4B9C0', width: 2}},
      {type: 'scatter3d', mode: 'lines', x, y, z, hoverinfo: 'skip',
        line: {color: view.share, colorscale: shares, cmin: 0, cmax: 1, width: 4}},
      mesh(view.ghosts, 0.35), mesh([0], 1)];
    const box = element('view').getBoundingClientRect();
    const away = 1.75 * Math.max(1, 1.25 * box.height / box.width);
    const side = (title, i) => ({title: {text: title}, range: [low[i], high[i]], ...grid,
      backgroundcolor: '#F7F8F9', showbackground: i === 2, tickfont: {size: 10}, nticks: 7});
    Plotly.newPlot('view', traces, clean({margin: {l: 0, r: 0, t: 0, b: 0}, scene: {
      xaxis: side('east [m]', 0), yaxis: side('north [m]', 1), zaxis: side('altitude [m]', 2),
      aspectmode: 'manual', dragmode: 'turntable',
      aspectratio: {x: 1.9 * size[0] / longest, y: 1.9 * size[1] / longest,
        z: 1.9 * size[2] / longest},
      camera: {eye: {x: away * view.camera[0], y: away * view.camera[1],
        z: away * view.camera[2]}}}}), config);
    element('view-hint').textContent = 'Equal scales' + (view.scale > 1 ?
      ', the aircraft drawn ' + view.scale + ' times its size' : '') +
      '. Blue: attached, orange: wing stalled; grey: the path on the ground plane.';
    drawn.push((frame) => {
      const at = placed(frame);
      const share = Array(view.corners.length).fill(view.frame_share[frame]);
      Plotly.restyle('view', {x: [at.x], y: [at.y], z: [at.z], intensity: [share]}, 3);
    });
  }

  function drawHistories() {
    const panels = page.panels, n = panels.length, gap = 0.25 / n;
    const layout = clean({margin: {l: 52, r: 10, t: 24, b: 42}, height: 70 + 112 * n,
      dragmode: touch ? false : 'zoom', hovermode: 'x', annotations: [], shapes: []});
    const traces = [];
    panels.forEach((panel, k) => {
      const tail = k ? String(k + 1) : '', top = 1 - k / n, bottom = top - (1 - gap * n) / n;
      layout['yaxis' + tail] = axis('', {domain: [Math.max(bottom, 0), top], fixedrange: true,
        nticks: 5, anchor: 'x' + tail});
      layout['xaxis' + tail] = axis(k === n - 1 ? page.axis.label + ' [' + page.axis.unit + ']' : '',
        {anchor: 'y' + tail, showticklabels: k === n - 1, ...(k ? {matches: 'x'} : {})});
      const names = panel.lines.filter((line) => !line.command).map((line) =>
        '<span style="color:' + line.colour + '">\u2014 ' + line.name + '</span>');
      const many = panel.lines.length > 1 ? '  ' + names.join('  ') : '';
      const pale = panel.lines.some((line) => line.command) ? '  <span style="color:#6B7178">' +
        'pale: commanded</span>' : '';
      layout.annotations.push(note('<b>' + panel.title + '</b> [' + panel.unit + ']' + many + pale,
        {y: top}));
      panel.lines.forEach((line) => traces.push({type: 'scatter', name: line.name, x: page.x,
        y: line.values, xaxis: 'x' + tail, yaxis: 'y' + tail,
        mode: page.points ? 'lines+markers' : 'lines', marker: {size: 5},
        line: {color: line.colour, width: line.command ? 4 : 1.6},
        hovertemplate: line.name + ' %{y:.4~g}<extra></extra>'}));
    });
    const whole = {xref: 'x', yref: 'paper', y0: 0, y1: 1};
    layout.shapes = [{type: 'line', ...whole, x0: 0, x1: 0,
      line: {color: colours.ink, width: 1.5}},
      ...page.shaded.map(([x0, x1]) => ({type: 'rect', ...whole, x0, x1, layer: 'below',
        fillcolor: colours.stalled, opacity: 0.08, line: {width: 0}}))];
    Plotly.newPlot('histories', traces, layout, config);
    element('histories').on('plotly_click', (event) => {
      const point = event.points[0];
      show(page.x.length === page.frames.length ? point.pointIndex : nearest(point.x));
    });
    element('histories-title').textContent = page.points ? 'Coefficients' : 'Time histories';
    element('histories-hint').textContent = (touch ? 'A tap' :
      'Drag to zoom all of them, double-click to see the whole again; a click') +
      ' goes there.' + (page.shaded.length ? ' Shaded: wing stalled, darker where half of it is.' :
        '');
    drawn.push((frame) => Plotly.relayout('histories', {
      'shapes[0].x0': page.frames[frame], 'shapes[0].x1': page.frames[frame]}));
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
  const last = page.frames.length - 1, slider = element('slider');
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
    const said = [[symbol, page.frames[frame].toFixed(digits) + space],
      ...page.readouts.map((each) => [each.label,
        each.values[frame] === null ? '-' : each.values[frame].toFixed(each.digits) + each.unit])];
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
