"use strict";

// Sixteen panels of Mueller elements, drawn from the data in the page; the controls are in the page too.
(() => {
  const holder = document.getElementById("panels-data");
  if (!holder) return;
  const data = JSON.parse(holder.textContent);
  const control = (name) => document.getElementById(`panels-${name}`);
  const drawing = control("drawing");
  const UNKNOWN = "#7f7f7f";
  const NEVER_VISIBLE = "#d2d2d2";
  // How far below its low end a scale keeps a colour for what is not known.
  const BELOW = 0.18;

  const decode = (text) => {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };

  // A script a slice and band, which calls `panelValues` when it has come; null while it is on its way.
  const values = new Map();
  const keyOf = (slice, band) => `slice${slice}_band${band}`;
  window.panelValues = (slice, band, texts) => values.set(keyOf(slice, band), texts.map(decode));
  const load = (slice, band, then) => {
    const key = keyOf(slice, band);
    if (values.has(key)) return;
    values.set(key, null);
    const script = document.createElement("script");
    script.src = `${data.address}/${key}.js`;
    script.onload = then;
    script.onerror = () => {
      control("where").textContent = `${script.getAttribute("src")} is not beside this page`;
    };
    document.head.append(script);
  };

  const planes = data.opens.map((opens) => {
    const held = data.slices[opens].held;
    const slices = [...data.slices.keys()].filter((slice) => data.slices[slice].held === held);
    return { held, slices, opens: slices.indexOf(opens) };
  });

  const state = () => {
    const plane = planes[Number(control("plane").value)];
    return {
      source: Number(control("source").value),
      slice: plane.slices[Number(control("held").value)],
      band: Number(control("band").value),
      half: Number(control("half").value),
      across: Number(control("across").value),
    };
  };

  const isDifference = (source) => source === data.sources.length;

  // Element as it is shown: M00 in 1/sr (a difference of it in %), the others divided by M00.
  const stored = (at, source, half, across, element) => {
    const slice = data.slices[at.slice];
    const start = (half * slice.across_deg.length + across) * 16;
    const all = values.get(keyOf(at.slice, at.band))[source];
    const first = all[start];
    if (!Number.isFinite(first)) return first;
    if (element === 0) return first > 0 ? first : NaN;
    return first > 0 ? all[start + element] / first : NaN;
  };

  const shown = (at, half, across, element) => {
    if (!isDifference(at.source)) return stored(at, at.source, half, across, element);
    const table = stored(at, 0, half, across, element);
    const model = stored(at, 1, half, across, element);
    if (table === -Infinity) return table;
    return element === 0 ? (100 * (model - table)) / table : model - table;
  };

  const limit = (value, low, high) => Math.min(Math.max(value, low), high);
  const powered = (value, exponent) => Math.sign(value) * Math.abs(value) ** exponent;

  // A scale maps a value to 0…1 and back, and names some values on its bar.
  const logarithmic = ([low, high]) => {
    const span = Math.log(high / low);
    return {
      place: (value) => limit(Math.log(value / low) / span, 0, 1),
      ticks: [0, 1 / 3, 2 / 3, 1].map((at) => low * Math.exp(at * span)),
      colours: data.size,
    };
  };
  const signed = (end) => ({
    place: (value) => limit(0.5 + value / (2 * end), 0, 1),
    ticks: [-end, -end / 2, 0, end / 2, end],
    colours: data.signed,
  });
  const signedGamma = () => ({
    place: (value) => limit(0.5 + powered(value, 1 / data.gamma) / 2, 0, 1),
    ticks: [-1, -0.5, -0.1, 0, 0.1, 0.5, 1],
    colours: data.signed,
  });

  const scalesFor = (at) => {
    const slice = data.slices[at.slice];
    if (!isDifference(at.source)) return [logarithmic(slice.first), signedGamma()];
    return [signed(slice.difference[0]), signed(slice.difference[1])];
  };

  const colourScale = (colours) => {
    const edge = BELOW / (1 + BELOW);
    const place = (index) => edge + ((1 - edge) * index) / (colours.length - 1);
    return [[0, UNKNOWN], [edge * 0.99, UNKNOWN], ...colours.map((colour, index) => [place(index), colour])];
  };

  const number = (value, digits = 3) => {
    if (value === -Infinity) return "not visible";
    if (Number.isNaN(value)) return "not known";
    const text = Number(value.toPrecision(digits));
    return (Math.abs(text) >= 1e-4 || text === 0 ? String(text) : text.toExponential()).replace("-", "−");
  };

  const acrossUnit = (at) => data.slices[at.slice].across;
  const elementName = (at, element) => {
    const place = `${Math.floor(element / 4)}${element % 4}`;
    const name = element === 0 ? "M00" : `M${place}/M00`;
    if (!isDifference(at.source)) return element === 0 ? "M00, 1/sr" : name;
    return element === 0 ? "ΔM00, %" : `Δ${name}`;
  };

  const traceOf = (at, element, scales) => {
    const slice = data.slices[at.slice];
    const scale = scales[element === 0 ? 0 : 1];
    const rows = slice.across_deg.map((_, across) =>
      data.theta_h_deg.map((__, half) => shown(at, half, across, element)),
    );
    const axis = element === 0 ? "" : String(element + 1);
    const bar = element < 2 && {
      orientation: "h",
      thickness: 12,
      outlinewidth: 0.5,
      len: element === 0 ? 0.42 : 0.52,
      x: element === 0 ? 0.2 : 0.73,
      y: -0.1,
      yanchor: "top",
      title: { text: barTitle(at, element), side: "bottom", font: { size: 11 } },
      tickvals: [-BELOW / 2, ...scale.ticks.map(scale.place)],
      ticktext: ["?", ...scale.ticks.map((tick) => number(tick, 2))],
      tickangle: 0,
      tickfont: { size: 10 },
    };
    return {
      type: "heatmap",
      x: data.theta_h_deg.map(Math.sqrt),
      y: slice.across_deg,
      z: rows.map((row) =>
        row.map((value) => (value === -Infinity ? null : Number.isNaN(value) ? -BELOW / 2 : scale.place(value))),
      ),
      customdata: rows.map((row) => row.map((value, half) => [number(value), number(data.theta_h_deg[half])])),
      hovertemplate: `${elementName(at, element)}: %{customdata[0]}<br>θh %{customdata[1]}°, ${acrossUnit(at)} %{y:.3~f}°<extra></extra>`,
      zmin: -BELOW,
      zmax: 1,
      colorscale: colourScale(scale.colours),
      showscale: Boolean(bar),
      ...(bar && { colorbar: bar }),
      xaxis: `x${axis}`,
      yaxis: `y${axis}`,
    };
  };

  const barTitle = (at, element) => {
    if (isDifference(at.source)) return element === 0 ? "ΔM00 / M00, %" : "Δ(Mij/M00), no unit";
    return element === 0 ? "M00, 1/sr (logarithmic)" : `Mij/M00, no unit (signed gamma 1/${data.gamma})`;
  };

  const layoutFor = (at) => {
    const slice = data.slices[at.slice];
    const layout = {
      margin: { l: 44, r: 8, t: 18, b: 96 },
      plot_bgcolor: NEVER_VISIBLE,
      paper_bgcolor: "#fff",
      font: { size: 11, color: "#1b1f24" },
      annotations: [],
      hovermode: "closest",
    };
    const [gapX, gapY] = [0.012, 0.035];
    const [width, height] = [(1 - 3 * gapX) / 4, (1 - 3 * gapY) / 4];
    const ticks = [0, 2, 10, 30, 60].filter((tick) => tick <= data.theta_h_deg.at(-1));
    for (let element = 0; element < 16; element++) {
      const [row, column] = [Math.floor(element / 4), element % 4];
      const [left, top] = [column * (width + gapX), 1 - row * (height + gapY)];
      const axis = element === 0 ? "" : String(element + 1);
      const shared = { fixedrange: true, showgrid: false, zeroline: false, ticks: "outside", ticklen: 3 };
      layout[`xaxis${axis}`] = {
        ...shared,
        domain: [left, left + width],
        anchor: `y${axis}`,
        tickvals: ticks.map(Math.sqrt),
        ticktext: ticks.map(String),
        showticklabels: row === 3,
        ...(row === 3 && column === 1 && { title: { text: "θh, ° (drawn over √θh)", standoff: 4, font: { size: 11 } } }),
      };
      layout[`yaxis${axis}`] = {
        ...shared,
        domain: [top - height, top],
        anchor: `x${axis}`,
        tickvals: slice.across === "φd" ? [-90, 0, 90] : [0, 30, 60],
        showticklabels: column === 0,
        ...(column === 0 && row === 2 && { title: { text: `${slice.across}, °`, standoff: 2, font: { size: 11 } } }),
      };
      layout.annotations.push({
        text: elementName(at, element),
        x: left,
        y: top,
        xref: "paper",
        yref: "paper",
        xanchor: "left",
        yanchor: "bottom",
        showarrow: false,
        font: { size: 10 },
      });
    }
    return layout;
  };

  // What the sliders say, which needs no values.
  const label = (at) => {
    const slice = data.slices[at.slice];
    const say = (name, text) => {
      control(`${name}-text`).textContent = text;
      control(name).ariaValueText = text;
    };
    say("band", `${number(data.wavelengths_nm[at.band], 4)} nm`);
    say("held", `${number(slice.held_deg, 4)}°`);
    say("half", `${number(data.theta_h_deg[at.half])}°`);
    say("across", `${number(slice.across_deg[at.across])}°`);
    control("held-name").textContent = slice.held;
    control("across-name").textContent = slice.across;
  };

  // The matrix at one node: what the pointer is on, or what the two sliders below say.
  const tell = (at) => {
    const slice = data.slices[at.slice];
    for (let element = 0; element < 16; element++) {
      const cell = control(`m${element}`);
      const value = shown(at, at.half, at.across, element);
      cell.value = Number.isFinite(value) ? value : "";
      cell.textContent = number(value);
    }
    control("where").textContent =
      `${control("source").selectedOptions[0].textContent} at ${number(data.wavelengths_nm[at.band], 4)} nm, ` +
      `${slice.held} = ${number(slice.held_deg, 4)}°, θh = ${number(data.theta_h_deg[at.half])}°, ` +
      `${slice.across} = ${number(slice.across_deg[at.across])}°`;
  };

  const draw = (at) => {
    const scales = scalesFor(at);
    const traces = Array.from({ length: 16 }, (_, element) => traceOf(at, element, scales));
    return Plotly.react(drawing, traces, layoutFor(at), { displayModeBar: false, responsive: true });
  };

  const tellNode = () => {
    const at = state();
    label(at);
    if (values.get(keyOf(at.slice, at.band))) tell(at);
  };

  const follow = ({ points: [point] }) => {
    [control("across").value, control("half").value] = point.pointIndex ?? point.pointNumber;
    tellNode();
  };

  // Draws what the controls say now; what is still on its way is drawn when it has come.
  const update = () => {
    const at = state();
    label(at);
    if (!values.get(keyOf(at.slice, at.band))) {
      load(at.slice, at.band, drawSoon);
      return;
    }
    tell(at);
    const drawn = wanted;
    draw(at).then(() => {
      // the element has its `on` from the first drawing on
      if (!drawing.dataset.follows) drawing.on("plotly_hover", follow);
      drawing.dataset.follows = "yes";
      if (drawn !== wanted) return;
      drawing.dataset.drawn = "yes";
      performance.mark("panels drawn");
    });
  };

  let waiting = false;
  let wanted = 0;
  const drawSoon = () => {
    wanted += 1;
    drawing.dataset.drawn = "no";
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      update();
    });
  };

  const fitPlane = () => {
    const plane = planes[Number(control("plane").value)];
    control("held").max = plane.slices.length - 1;
    control("held").value = plane.opens;
    const length = data.slices[plane.slices[plane.opens]].across_deg.length;
    control("across").max = length - 1;
    control("across").value = Math.floor(length / 2);
  };

  for (const name of ["source", "held", "band"]) control(name).addEventListener("input", drawSoon);
  control("plane").addEventListener("input", () => {
    fitPlane();
    drawSoon();
  });
  for (const name of ["half", "across"]) control(name).addEventListener("input", tellNode);

  fitPlane();
  control("view").hidden = false;
  drawSoon();
})();
