// Copyright 2026 the poststall_sim developers
// SPDX-License-Identifier: Apache-2.0

// How figures look in a browser, and the span loading: for the report and for the live page.
'use strict';
const poststallFigures = (colours) => {
  const narrow = window.matchMedia('(max-width: 700px)').matches;
  const touch = window.matchMedia('(pointer: coarse)').matches;
  const font = {family: 'system-ui, sans-serif', size: narrow ? 11 : 12, color: colours.ink};
  const config = {displaylogo: false, responsive: true, displayModeBar: touch ? false : 'hover',
    modeBarButtonsToRemove: ['select2d', 'lasso2d', 'autoScale2d', 'tableRotation',
      'resetCameraLastSave3d']};
  const grid = {gridcolor: '#E6E8EB', zerolinecolor: '#B9BEC5', linecolor: '#8A9099'};
  const count = (n) => Array.from({length: n}, (_, i) => i);
  const axis = (title, more) => ({title: {text: title, standoff: 6}, ...grid, ...more});
  const clean = (layout) => ({font, paper_bgcolor: '#fff', plot_bgcolor: '#fff',
    separators: '.', showlegend: false, ...layout});
  const key = (colour, text) => '<span style="color:' + colour + '">' + text + '</span>';
  // Zero has no sign.
  const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]+$)/, '');

  // The lift, the colour and the sign of each strip of some surfaces, as restyle takes them.
  function marked(cl, stalled, groups) {
    const own = (values) => groups.map((group) => values.slice(group.begin, group.end));
    const pick = (yes, no) => own(cl.map((_, i) => stalled !== null && stalled[i] ? yes : no));
    return {y: own(cl), 'marker.symbol': pick('triangle-down', 'circle'),
      'marker.color': pick(colours.stalled, colours.attached)};
  }

  // What figures of strips say and how they draw one surface.
  const ofStrips = (strips) => ({
    legend: strips === null || strips.stalled === null ? '' :
      key(colours.attached, '\u25cf attached') + '\u2002 ' +
      key(colours.stalled, '\u25bc past its stall') + '\u2002 ',   // a line may end at the blank
    small: (groups) => groups.length < 2 ? '' : '\u2002small: ' +
      groups.slice(1).map((group) => group.name.replace(/[<&]/g, '')).join(', ') + '.',
    surfaceTrace: (group, number, more) => ({type: 'scatter', name: group.name, x: [], y: [],
      marker: {size: number ? 6 : 9, opacity: number ? 0.6 : 1, line: {width: 0}}, ...more})});

  // Draws the span loading without its lift; returns the surfaces that are in it. averaged: say
  // what the non-local closure does to it; the live page has no room, and is not told the closure.
  function drawLoading(strips, averaged = false) {
    const {legend, small, surfaceTrace} = ofStrips(strips);
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
    document.getElementById('loading-hint').innerHTML = legend + (strips.cl_max === null ? '' :
      key(colours.limit, '- - greatest cl of the section')) + small(groups) +
      (strips.cl_max === null || !averaged ? '' : ' One strip may lie above the line: by the ' +
        'non-local closure it holds for the mean over about a chord of the span.');
    Plotly.newPlot('loading', traces, clean({
      margin: {l: 48, r: 10, t: 8, b: 42}, dragmode: false,
      xaxis: axis('y [m], port on the left', {range: [half, -half], fixedrange: true}),
      yaxis: axis('strip cl [-]', {range: strips.range, fixedrange: true})}), config);
    return groups;
  }

  return {narrow, touch, font, config, grid, count, axis, clean, key, fixed, marked, ofStrips,
    drawLoading};
};
