// The camera. Points are relative to the middle of the box of all frames, m. Matrices are
// stored by columns, for WebGL.

// Size of the view over that of the box: some is left free, in the plane for the scale bar.
const PLANE_MARGIN = 1.2;
const ORBIT_MARGIN = 1.12;

// Looks straight at the plane.
class PlaneCamera {
  constructor(extent) {
    this.extent = extent;
    // Factor on the fill of blocks on the side away from the light.
    this.ambient = 1;
    this.light = [0, 0, 1];
    // Depth in front of which edges are cut off; without perspective all points have depth 1.
    this.near = 0.5;
    this.reset();
  }

  reset() {
    this.middle = [0, 0];
    this.magnification = 1;
  }

  // Width over height of the box.
  shape() {
    return this.extent[0] / Math.max(this.extent[1], 1e-12);
  }

  // Height of the view, m; the width is `aspect` times that.
  height(aspect) {
    const [width, height] = this.extent;
    return (PLANE_MARGIN * Math.max(height, width / aspect, 1e-12)) / this.magnification;
  }

  matrix(aspect) {
    const up = 2 / this.height(aspect);
    const right = up / aspect;
    const [x, y] = this.middle;
    return [right, 0, 0, 0, 0, up, 0, 0, 0, 0, 0, 0, -right * x, -up * y, 0, 1];
  }

  // Follows a drag, in shares of the height of the view.
  shift(dx, dy, aspect) {
    const height = this.height(aspect);
    this.middle = [this.middle[0] - dx * height, this.middle[1] + dy * height];
  }

  // In the plane a drag shifts.
  turn(dx, dy, aspect) {
    this.shift(dx, dy, aspect);
  }

  // Magnifies about a place, in shares of the height of the view from its middle, so that what
  // is seen there stays.
  zoom(factor, dx, dy, aspect) {
    const before = this.height(aspect);
    this.magnification = Math.min(1e4, Math.max(0.1, this.magnification * factor));
    const change = before - this.height(aspect);
    this.middle = [this.middle[0] + dx * change, this.middle[1] - dy * change];
  }
}

// Goes around a point, z staying upwards.
class OrbitCamera {
  constructor(extent) {
    this.radius = Math.max(1e-12, 0.5 * Math.hypot(...extent));
    const [x, y, z] = extent.map((size) => size / 2);
    this.corners = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => [-1, 1].map((c) =>
      [a * x, b * y, c * z])));
    this.ambient = 0.42;
    this.reset();
  }

  reset() {
    this.azimuth = -1.05;
    this.elevation = 0.38;
    this.magnification = 1;
    this.target = [0, 0, 0];
    this.look();
    this.home = this.axes;
  }

  // Sets the axes of the view: to the right, upwards, and back to the eye.
  look() {
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    const right = [-sa, ca, 0];
    const up = [-se * ca, -se * sa, ce];
    const back = [ce * ca, ce * sa, se];
    this.axes = { right, up, back };
    // From over the left shoulder.
    const light = right.map((_, i) => -0.35 * right[i] + 0.6 * up[i] + 0.72 * back[i]);
    const size = Math.hypot(...light);
    this.light = light.map((component) => component / size);
  }

  // Width over height of the box as it is seen at the start.
  shape() {
    const size = (axis) => Math.max(...this.corners.map((corner) => dot(corner, axis)));
    return size(this.home.right) / Math.max(size(this.home.up), 1e-12);
  }

  // Distance of the eye, m, from which the box just fits into the view that the run starts with.
  distance(aspect) {
    const { right, up, back } = this.home;
    const away = this.corners.map((corner) => {
      const across = Math.abs(dot(corner, right)) / (TANGENT * aspect);
      return dot(corner, back) + Math.max(across, Math.abs(dot(corner, up)) / TANGENT);
    });
    return (ORBIT_MARGIN * Math.max(...away)) / this.magnification;
  }

  matrix(aspect) {
    const { right, up, back } = this.axes;
    const distance = this.distance(aspect);
    const eye = dot(this.target, back) + distance;
    // Between them lies all that there is.
    const reach = this.radius + Math.hypot(...this.target);
    this.near = Math.max(distance - reach, 0.01 * distance);
    const far = distance + reach;
    const depth = (far + this.near) / (this.near - far);
    const depthOffset = (2 * far * this.near) / (this.near - far);
    const [across, upward] = [1 / (TANGENT * aspect), 1 / TANGENT];
    const column = (i) => [across * right[i], upward * up[i], depth * back[i], -back[i]];
    const last = [-across * dot(this.target, right), -upward * dot(this.target, up),
      -depth * eye + depthOffset, eye];
    return [...column(0), ...column(1), ...column(2), ...last];
  }

  turn(dx, dy) {
    this.azimuth -= 4 * dx;
    this.elevation = Math.min(1.57, Math.max(-1.57, this.elevation + 4 * dy));
    this.look();
  }

  shift(dx, dy, aspect) {
    const height = 2 * TANGENT * this.distance(aspect);
    const { right, up } = this.axes;
    this.target = this.target.map((at, i) => at + height * (dy * up[i] - dx * right[i]));
  }

  zoom(factor) {
    this.magnification = Math.min(50, Math.max(0.1, this.magnification * factor));
  }
}

// Of half the angle of view, which is 30 degrees from top to bottom.
const TANGENT = Math.tan(Math.PI / 12);

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Lets pointers move a camera over an element: one turns or, with Shift or the right button,
// shifts; two pinch. `changed` is called after each change.
class CameraPointer {
  constructor(element, camera, changed) {
    Object.assign(this, { element, camera, changed });
    this.pointers = new Map();
    const listen = (kind, heard) => element.addEventListener(kind, heard, { passive: false });
    listen("pointerdown", (event) => this.press(event));
    listen("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      listen(kind, (event) => this.pointers.delete(event.pointerId));
    }
    listen("wheel", (event) => this.wheel(event));
    listen("contextmenu", (event) => event.preventDefault());
    listen("dblclick", () => this.change(() => camera.reset()));
  }

  change(how) {
    how();
    this.changed();
  }

  aspect() {
    return this.element.clientWidth / this.element.clientHeight;
  }

  // Of a place on the screen, from the middle of the element, in shares of its height.
  place(event) {
    const box = this.element.getBoundingClientRect();
    return {
      x: (event.clientX - box.left - box.width / 2) / box.height,
      y: (event.clientY - box.top - box.height / 2) / box.height,
    };
  }

  press(event) {
    this.element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.place(event));
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const after = this.place(event);
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    this.pointers.set(event.pointerId, after);
    if (others.length > 0) {
      this.change(() => this.pinch(before, after, others[0][1]));
      return;
    }
    const shifts = event.shiftKey || (event.buttons & 2) !== 0;
    const [dx, dy] = [after.x - before.x, after.y - before.y];
    this.change(() => this.camera[shifts ? "shift" : "turn"](dx, dy, this.aspect()));
  }

  // One of two pointers has moved, the other has not.
  pinch(before, after, other) {
    const apart = (place) => Math.hypot(place.x - other.x, place.y - other.y);
    const factor = Math.max(apart(after), 1e-3) / Math.max(apart(before), 1e-3);
    const [x, y] = [(after.x + other.x) / 2, (after.y + other.y) / 2];
    this.camera.shift((after.x - before.x) / 2, (after.y - before.y) / 2, this.aspect());
    this.camera.zoom(factor, x, y, this.aspect());
  }

  wheel(event) {
    event.preventDefault();
    // Wheels tell pixels, lines or pages.
    const pixels = event.deltaY * [1, 30, 300][event.deltaMode];
    const factor = Math.exp(-0.0015 * Math.min(300, Math.max(-300, pixels)));
    const { x, y } = this.place(event);
    this.change(() => this.camera.zoom(factor, x, y, this.aspect()));
  }
}
