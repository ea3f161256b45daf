// Moves the drawing of the press to the cursor of its plots: the press, and the slider of each model enlarged.

function crossing([ax, ay], fromA, [bx, by], fromB, side) {
  const distance = Math.hypot(bx - ax, by - ay), along = (distance ** 2 + fromA ** 2 - fromB ** 2) / (2 * distance);
  const across = side * Math.sqrt(Math.max(0, fromA ** 2 - along ** 2)), x = (bx - ax) / distance, y = (by - ay) / distance;
  return [ax + along * x - across * y, ay + along * y + across * x];
}

// A linkage: every body is a group, moved by its channels, or where these are constant left at its start.
function moveBodies(viewer, figure, {bodies, springs, view: [scale, left, top]}) {
  viewer.moved.push(({data}, index) => {
    const value = name => data.channels.find(c => c.name === name)?.values[0][index], place = {frame: [0, 0, 0]};
    for (const [body, start] of Object.entries(bodies))
      place[body] = ["x", "y", "angle"].map((name, n) => value(`${body}.${name}`) ?? start[n]);
    for (const group of figure.querySelectorAll(".member")) {
      const [x, y, angle] = place[group.dataset.body];
      group.setAttribute("transform", `translate(${left + scale * x} ${top - scale * y}) rotate(${-angle * 180 / Math.PI})`);
      for (const text of group.querySelectorAll(".name")) text.setAttribute("transform", `rotate(${angle * 180 / Math.PI})`);
    }
    figure.querySelectorAll(".spring").forEach((line, n) => {
      const ends = springs[n].map(([body, px, py]) => {
        const [x, y, angle] = place[body], c = Math.cos(angle), s = Math.sin(angle);
        return `${left + scale * (x + c * px - s * py)} ${top - scale * (y + s * px + c * py)}`;
      });
      line.setAttribute("d", `M${ends.join("L")}`);
    });
    figure.querySelector("text.heading").textContent = `linkage at ${data.t[index].toFixed(4)} s`;
  });
}

function animate(viewer) {
  const figure = viewer.root.parentElement.closest("section").querySelector(".schematic[data-geometry]");
  if (!figure) return;
  const g = JSON.parse(figure.dataset.geometry), m = g.mechanism, [scale, left, top] = g.view;
  const part = name => figure.querySelector(name);
  if (g.bodies) return moveBodies(viewer, figure, g);
  const at = ([x, y]) => [left + scale * x, top - scale * y];
  const line = (name, a, b) => {
    const [[x1, y1], [x2, y2]] = [at(a), at(b)];
    for (const [key, value] of Object.entries({x1, y1, x2, y2})) part(`.link.${name}`).setAttribute(key, value.toFixed(1));
  };
  const heading = part("text.heading"), slider = part("rect.slider");
  const [cx, cy, width, height] = g.slider;
  const corners = {ll: [-1, 1], lr: [1, 1], ur: [1, -1], ul: [-1, -1]};

  viewer.moved.push(({data}, index) => {
    const t = data.t[index], channel = name => data.channels.find(c => c.name === name);
    const angle = (m.crank_angle_deg + g.speed * t) * Math.PI / 180, {crank, rod2, rocker, rod4} = m;
    const O = [0, 0], A = [crank.length * Math.cos(angle), crank.length * Math.sin(angle)], H = m.rocker_pivot;
    const B = crossing(A, rod2.length, H, rocker.centroid, m.rocker_branch), reach = rocker.length / rocker.centroid;
    const C = [H[0] + reach * (B[0] - H[0]), H[1] + reach * (B[1] - H[1])];
    const y = channel("slider_y"), below = Math.sqrt(Math.max(0, rod4.length ** 2 - (m.guide_x - C[0]) ** 2));
    const F = [m.guide_x, y ? y.values[0][index] : C[1] + m.slider_branch * below];
    line("crank", O, A); line("rod2", A, B); line("rocker", H, C); line("rod4", C, F);
    for (const [name, point] of Object.entries({O, A, B, H, C, F})) {
      const [x, z] = at(point);
      part(`.at-${name}`).setAttribute("cx", x.toFixed(1));
      part(`.at-${name}`).setAttribute("cy", z.toFixed(1));
    }
    slider.setAttribute("y", (at(F)[1] - slider.height.baseVal.value / 2).toFixed(1));
    heading.textContent = `press at ${t.toFixed(4)} s`;
    // Relative displacements are enlarged alike, so that a corner touches its wall where its gap is zero.
    data.strongest ??= Math.max(1e-12, ...data.contacts.flat().map(k => k[3]), ...Object.keys(corners)
      .flatMap(name => channel(`corner_${name}_normal`)?.values[0] ?? []));
    data.labels.forEach((_, side) => {
      const value = name => channel(name)?.values[side][index] ?? 0, model = STYLES[side].name;
      const x = value("slider_x"), turned = value("slider_angle") * m.slider.length / 2;
      const places = Object.fromEntries(Object.entries(corners).map(([name, [i, j]]) =>
        [name, [cx + i * width / 2 + g.magnified * (x + j * turned), cy + j * height / 2]]));
      part(`.body.${model}`).setAttribute("points", Object.values(places).map(p => p.map(v => v.toFixed(1)).join()).join(" "));
      for (const [name, [i]] of Object.entries(corners)) {
        // Square root: small forces beside the peak of the first impact remain visible.
        const force = value(`corner_${name}_normal`), long = force > 0 ? 8 + 40 * Math.sqrt(Math.min(1, force / data.strongest)) : 0;
        const [px, py] = places[name], z = py + (side ? 3 : -3), way = -i;
        part(`.force.${model}.${name}`).setAttribute("d", long ? `M${px} ${z}h${way * long}M${px + way * 5} ${z - 3}L${px} ${z}l${way * 5} 3` : "");
      }
    });
  });
}
