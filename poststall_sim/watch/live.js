// Copyright 2026 the poststall_sim developers
// SPDX-License-Identifier: Apache-2.0

// What the live page does: draws what the server sends, and sends what sliders and keys ask for.
'use strict';
(() => {
  const colours = JSON.parse(document.body.dataset.colours);
  const shared = poststallFigures(colours);
  const {narrow, font, config, count, axis, clean, key, fixed, marked, drawLoading} = shared;
  const aircraft = poststallAircraft(colours, shared);
  const element = (id) => document.getElementById(id);
  const make = (name, more, ...inside) => {
    const made = Object.assign(document.createElement(name), more);
    made.append(...inside);
    return made;
  };
  const degrees = 180 / Math.PI;
  const keyInAddress = location.hash.slice(1);
  const parts = {};   // the latest of each kind
  const known = (value) => value !== null && value !== undefined;
  const scaled = (name, factor) => (values) =>
    values && known(values[name]) ? values[name] * factor : null;

  // Draws at most so often.
  function figure(period, draw) {
    let due = 0;
    return (now) => {
      if (now < due) return;
      due = now + period;
      draw();
    };
  }

  // ---- span loading ----
  let loadingOf = null, loadingGroups = [], loadingRange = [0, 0];
  function drawLift() {
    const {state, setup} = parts;
    if (!state || !state.cl || !state.stalled || !setup.strips) return;
    if (state.cl.length !== setup.strips.y.length) return;   // another aircraft's, still
    const wing = setup.strips.groups[0];
    const own = (values) => values.slice(wing.begin, wing.end).filter(known);
    if (loadingOf !== setup.strips) {
      loadingOf = setup.strips;
      loadingRange = [-0.3, 1.25 * Math.max(1, ...own(setup.strips.cl_max))];
      loadingGroups = drawLoading({...setup.strips, stalled: true, range: loadingRange});
    }
    const stalled = state.stalled.map((each) => each > 0.5);
    Plotly.restyle('loading', marked(state.cl, stalled, loadingGroups),
      count(loadingGroups.length));
    const low = Math.min(loadingRange[0], ...own(state.cl));
    const high = Math.max(loadingRange[1], ...own(state.cl));
    if (low < loadingRange[0] || high > loadingRange[1]) {
      loadingRange = [1.05 * low, 1.05 * high];
      Plotly.relayout('loading', {'yaxis.range': loadingRange});
    }
  }

  // ---- time histories ----
  const SECONDS = 60, SAMPLES = 10;
  let kept = [];   // time, and what the panels show
  let panels = [], panelsOf = null;
  function remember(state) {
    const last = kept.length ? kept[kept.length - 1].time : -Infinity;
    if (state.time < last) kept = [];
    if (kept.length && state.time < last + 1 / SAMPLES) return;
    kept = kept.filter((each) => each.time > state.time - SECONDS).concat(state);
  }
  const COLOURS = [colours.ink, colours.second, colours.third, colours.limit, colours.attached];
  function beginHistories(controls) {
    const of = (name, colour, get) => ({name, colour, get});
    panels = [
      {title: 'airspeed [m/s]', least: 1, lines: [of('airspeed', colours.attached, scaled('airspeed', 1))]},
      {title: 'flow angles [deg]', least: 2, lines: [
        of('alpha', colours.attached, scaled('alpha', degrees)),
        of('beta', colours.third, scaled('beta', degrees))]},
      {title: 'altitude [m]', least: 1, lines: [of('altitude', colours.attached, scaled('altitude', 1))]},
      {title: 'controls [deg]', least: 2, lines: controls.map((name, i) => of(name,
        COLOURS[i % COLOURS.length], (s) => scaled(name, degrees)(s.controls)))}];
    const columns = narrow ? 1 : 2, rows = panels.length / columns;
    const layout = clean({margin: {l: 44, r: 8, t: 20, b: 36}, dragmode: false, annotations: []});
    panels.forEach((panel, k) => {
      const tail = k ? String(k + 1) : '', column = k % columns, row = Math.floor(k / columns);
      const wide = (1 - 0.09 * (columns - 1)) / columns, tall = 1 / (1.3 * rows - 0.3);
      const left = column * (wide + 0.09), top = 1 - 1.3 * tall * row, last = row === rows - 1;
      layout['xaxis' + tail] = axis(last ? 'time before now [s]' : '', {domain: [left, left + wide],
        range: [-SECONDS, 0], anchor: 'y' + tail, showticklabels: last, fixedrange: true});
      layout['yaxis' + tail] = axis('', {domain: [Math.max(top - tall, 0), top], nticks: 5,
        anchor: 'x' + tail, fixedrange: true, automargin: 'left'});
      const names = panel.lines.length < 2 ? [] : panel.lines.map((line) =>
        key(line.colour, '\u2014 ' + line.name.replace(/[<&]/g, '')));
      layout.annotations.push({text: ['<b>' + panel.title + '</b>', ...names].join(' '),
        showarrow: false, xref: 'paper', yref: 'paper', x: left, y: top, xanchor: 'left',
        yanchor: 'bottom', font: {size: font.size}});
    });
    const traces = panels.flatMap((panel, k) => panel.lines.map((line) => ({type: 'scatter',
      mode: 'lines', name: line.name, x: [], y: [], line: {color: line.colour, width: 1.6},
      xaxis: 'x' + (k ? k + 1 : ''), yaxis: 'y' + (k ? k + 1 : ''),
      hovertemplate: line.name + ' %{y:.4~g}<extra></extra>'})));
    Plotly.newPlot('histories', traces, layout, config);
  }
  function drawHistories() {
    if (!parts.state || !parts.state.targets) return;
    const names = Object.keys(parts.state.targets).filter((name) => name !== 'throttle');
    if (panelsOf !== names.join()) { panelsOf = names.join(); beginHistories(names); }
    const lines = panels.flatMap((panel) => panel.lines);
    const x = kept.map((each) => each.time - parts.state.time);
    const y = lines.map((line) => kept.map(line.get));
    Plotly.update('histories', {x: lines.map(() => x), y}, ranges(y), count(lines.length));
  }

  // The range of each panel: all that it shows with some room, and never less than what matters,
  // or steady flight would be drawn as the noise of its last digits.
  function ranges(y) {
    const found = {};
    let first = 0;
    panels.forEach((panel, k) => {
      const own = y.slice(first, first += panel.lines.length).flat().filter(known);
      if (!own.length) return;
      const low = own.reduce((a, b) => Math.min(a, b)), high = own.reduce((a, b) => Math.max(a, b));
      const half = Math.max(0.55 * (high - low), 0.5 * panel.least), middle = 0.5 * (low + high);
      found['yaxis' + (k ? k + 1 : '') + '.range'] = [middle - half, middle + half];
    });
    return found;
  }

  // ---- gauges ----
  const share = (state) => {
    const wing = parts.setup.strips && parts.setup.strips.groups[0];
    if (!wing || !state.stalled) return null;
    const own = state.stalled.slice(wing.begin, wing.end);
    return 100 * own.filter((each) => each > 0.5).length / own.length;
  };
  const GAUGES = [   // name, unit, digits, value, id
    ['airspeed', 'm/s', 1, scaled('airspeed', 1)], ['altitude', 'm', 1, scaled('altitude', 1)],
    ['alpha', '\u00b0', 1, scaled('alpha', degrees)],
    ['beta', '\u00b0', 1, scaled('beta', degrees)],
    ['load factor', '', 2, scaled('load_factor', 1)],
    ['bank, pitch', '\u00b0', 0, (state) => [state.bank * degrees, state.pitch * degrees]],
    ['heading', '\u00b0', 0, (state) => Math.round(state.heading * degrees + 360) % 360],
    ['stalled', '%', 0, share]];
  const gauges = GAUGES.map(([name]) => {
    const value = make('dd', {textContent: '\u2013'});
    const box = make('div', {}, make('dt', {textContent: name}), value);
    box.dataset.gauge = name;
    element('gauges').append(box);
    return {box, value};
  });
  function drawGauges() {
    const state = parts.state;
    if (!state) return;
    GAUGES.forEach(([name, unit, digits, get], i) => {
      const found = get(state);
      const text = known(found) ? [found].flat().map((each) => fixed(each, digits)).join(', ') :
        '\u2013';
      gauges[i].value.replaceChildren(text, make('small', {
        textContent: unit && known(found) ? '\u202f' + unit : ''}));
      if (name === 'stalled') gauges[i].box.classList.toggle('warn', found > 0);
    });
    element('ball').setAttribute('transform',
      'rotate(' + -state.bank * degrees + ') translate(0 ' + state.pitch * degrees + ')');
  }

  // ---- controls ----
  const sliders = {};   // by name: the slider, what it says, its limits, its factor
  let held = null, taken_at = null;   // what this page commands, and what that began with
  const unit = (name) => name === 'throttle' ? ['%', 100, 0] : ['\u00b0', degrees, 1];
  function beginControls() {
    const {limits} = parts.setup, names = Object.keys(parts.state.targets);
    element('controls').replaceChildren(...names.map((name) => {
      const [sign, factor] = unit(name);
      const [low, high] = limits[name] || (name === 'throttle' ? [0, 1] : [-0.6, 0.6]);
      const input = make('input', {type: 'range', id: 'control-' + name, min: low * factor,
        max: high * factor, step: 'any', disabled: true});
      const said = make('output', {htmlFor: input.id});
      input.addEventListener('input', () => move(name, Number(input.value) / factor));
      // The arrows fly again once the finger or the mouse has let go.
      input.addEventListener('pointerup', () => input.blur());
      sliders[name] = {input, said, low, high, factor, sign};
      return make('div', {className: 'control'},
        make('label', {htmlFor: input.id, textContent: name}),
        make('div', {className: 'track'}, input), said);
    }));
  }
  let controlsOf = null;
  function drawControls() {
    const {state, setup, stick} = parts;
    if (!state || !state.targets || !state.controls || !stick) return;
    const shown = JSON.stringify([setup.limits, Object.keys(state.targets)]);
    if (controlsOf !== shown) { controlsOf = shown; beginControls(); }
    for (const [name, {input, said, factor, sign}] of Object.entries(sliders)) {
      if (!(name in state.targets)) continue;
      const told = held === null ? state.targets[name] : held[name];
      input.disabled = held === null;
      if (document.activeElement !== input || held === null) input.value = told * factor;
      const [, , digits] = unit(name);
      said.replaceChildren(fixed(told * factor, digits) + sign + ' ', make('small', {
        textContent: 'is ' + fixed(state.controls[name] * factor, digits) + sign}));
    }
  }
  function move(name, value) {
    if (held === null || !(name in held)) return;
    const {low, high, input, factor} = sliders[name];
    held[name] = Math.min(Math.max(value, low), high);
    input.value = held[name] * factor;
    send({fly: held});
  }
  function take() {
    if (!parts.stick || !parts.stick.may || !parts.state || !parts.state.targets) return;
    const within = Object.entries(parts.state.targets)
      .filter(([name]) => name in parts.setup.limits);
    if (!within.length) {
      answer(false, 'the limits of the controls are not known: name its file with --aircraft');
      return;
    }
    held = Object.fromEntries(within);
    taken_at = {...held};
    send({take: held});
    showStick();
  }
  function release() {
    if (held !== null) send({release: true});
    held = null;
    showStick();
  }
  function showStick() {
    const {stick} = parts, may = Boolean(stick && stick.may);
    element('buttons').hidden = !may;
    element('take').textContent = held === null ? 'Take the controls' : 'Let go of the controls';
    element('take').classList.toggle('mine', held !== null);
    const keys = [['\u2190 \u2192', 'aileron'], ['\u2191 \u2193', 'elevator (down pulls)'],
      ['A D', 'rudder'], ['W S', 'throttle'], ['C', 'as when taken'], ['T', 'take'],
      ['Esc', 'let go'], ['P', 'pause']].map(([pressed, what]) =>
      pressed.split(' ').map((each) => '<kbd>' + each + '</kbd>').join('') + ' ' + what);
    element('controls-hint').innerHTML = !may ? (keyInAddress ? '' :
      'Watching only: <code>poststall watch --control</code> prints an address that can fly.') :
      (held !== null ? 'This page flies. ' : stick.taken ? 'Another page flies. ' : '') +
      '<span class="keys">' + keys.join(', ') + '. </span>' +
      'Positive: edge down, roll to the right, yaw to the left.';
  }
  element('take').addEventListener('click', () => held === null ? take() : release());
  const pause = () => send({act: paused() ? 'fly on' : 'pause'});
  const paused = () => parts.link && parts.link.text.startsWith('paused');
  element('pause').addEventListener('click', pause);
  for (const id of ['reset', 'trim']) element(id).addEventListener('click', () => {
    release();   // else the controls of before would fly the new flight
    send({act: id});
  });
  const KEYS = {ArrowLeft: ['aileron', -1], ArrowRight: ['aileron', 1], ArrowUp: ['elevator', 1],
    ArrowDown: ['elevator', -1], a: ['rudder', 1], d: ['rudder', -1], w: ['throttle', 1],
    s: ['throttle', -1]};
  document.addEventListener('keydown', (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || !parts.stick || !parts.stick.may) return;
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const on_slider = event.target.type === 'range' && pressed.startsWith('Arrow');
    if (KEYS[pressed] && held !== null && !on_slider) {
      const [name, way] = KEYS[pressed];
      if (!(name in held)) return;
      move(name, held[name] + way * 0.02 * (sliders[name].high - sliders[name].low));
    } else if (pressed === 'c' && held !== null) {
      Object.entries(taken_at).forEach(([name, value]) => move(name, value));
    } else if (pressed === 't' && held === null) take();
    else if (pressed === 'Escape') release();
    else if (pressed === 'p' && !event.repeat) pause();
    else return;
    event.preventDefault();
  });

  // ---- what is said ----
  let answered = 0;
  function answer(done, text) {
    element('answer').textContent = text;
    clearTimeout(answered);
    answered = setTimeout(() => { element('answer').textContent = ''; }, done ? 6000 : 12000);
  }
  function showLink() {
    const {link, setup = {namespace: '/', aircraft: ''}} = parts;
    if (!link) return;
    element('link').textContent = link.text;
    element('link').className = link.level ? 'warn' : '';
    document.body.classList.toggle('stale', !link.there);
    element('pause').textContent = paused() ? 'Fly on' : 'Pause';
    const where = setup.namespace === '/' ? '' : ' in ' + setup.namespace;
    document.title = (setup.aircraft ? 'Flight of ' + setup.aircraft : 'poststall watch') + where;
    element('title').textContent = document.title;
  }
  function showReport() {
    const said = [], {pace, commands, solver, engines, controls} = parts.report;
    const number = (part, name, digits) => fixed(Number(part.values[name]), digits);
    if (pace && known(pace.values.real_time_factor_now)) {
      said.push('real-time factor ' + number(pace, 'real_time_factor_now', 2));
    }
    if (pace) said.push(pace.text);
    if (commands) said.push(commands.text);
    if (solver) {
      said.push('solver ' + solver.text + ', ' + number(solver, 'iterations_mean', 1) +
        ' iterations a step');
    }
    for (const part of [engines, controls]) if (part && part.level) said.push(part.text);
    element('report').textContent = said.join(' \u00b7 ');
  }

  const figures = [figure(60, drawGauges), figure(60, drawControls),
    figure(40, () => aircraft.draw(parts)), figure(90, drawLift), figure(250, drawHistories)];
  // For two thirds of the time at most: a slow phone has to keep up, and to hear its fingers.
  let waiting = false, rested = 0;
  function drawSoon() {
    if (waiting || performance.now() < rested) return;
    waiting = true;
    requestAnimationFrame(() => {
      const begun = performance.now();
      waiting = false;
      for (const draw of figures) draw(begun);
      rested = 1.5 * performance.now() - 0.5 * begun;
    });
  }
  setInterval(drawSoon, 250);   // what was put off, and what came last before time stood still

  const heard = {
    answer: ({done, text}) => answer(done, text),
    state: (state) => { remember(state); aircraft.follow(state); drawSoon(); },
    shape: aircraft.forget,
    setup: showLink, link: showLink, report: showReport,
    stick: (stick) => {
      if (held !== null && !stick.mine && stick.was) {
        held = null;
        answer(false, stick.taken ? 'another page has taken the controls' :
          'the controls were let go of: this page was silent');
      }
      showStick();
    },
  };
  let socket = null, stopped = '';   // why the server has stopped, if it could say so
  function send(order) {
    if (socket !== null && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(order));
  }
  function connect() {
    socket = new WebSocket('ws://' + location.host + '/live' +
      (keyInAddress ? '?key=' + encodeURIComponent(keyInAddress) : ''));
    socket.addEventListener('message', (event) => {
      const {kind, ...part} = JSON.parse(event.data);
      stopped = '';
      if (kind === 'stick') part.was = parts.stick && parts.stick.mine;
      parts[kind] = part;
      if (heard[kind]) heard[kind](part);
    });
    socket.addEventListener('close', (event) => {
      held = null;
      stopped = event.reason || stopped;
      parts.stick = undefined;
      parts.link = {level: 1, there: false, text: stopped ?
        'poststall watch has stopped, its terminal says where: ' + stopped :
        'no connection to poststall watch: it has ended' +
        (keyInAddress ? ', or the address is of an earlier one' : '') + '; trying again'};
      showLink();
      showStick();
      setTimeout(connect, 1000);
    });
  }
  setInterval(() => {
    if (held !== null && parts.stick && parts.stick.mine) send({fly: held});
  }, 100);
  window.addEventListener('hashchange', () => location.reload());
  showStick();
  connect();
})();
