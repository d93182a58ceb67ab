// Arrays as the page holds them: base64 of zlib streams of numbers, lowest byte first, which is
// the order of every machine that shows web pages.

function bytesOfBase64(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

// `Numbers` is the kind of typed array: Uint8Array, Uint16Array or Uint32Array.
async function decode(text, Numbers) {
  const packed = new Blob([bytesOfBase64(text)]).stream();
  const unpacked = packed.pipeThrough(new DecompressionStream("deflate"));
  return new Numbers(await new Response(unpacked).arrayBuffer());
}

async function decodeTopology(topology) {
  return {
    triangles: await decode(topology.triangles, Uint32Array),
    edges: await decode(topology.edges, Uint32Array),
    block: await decode(topology.block, Uint16Array),
  };
}

async function decodeFrame(frame) {
  const bytes = async (text) => (text === null ? null : decode(text, Uint8Array));
  return {
    time: frame.time,
    topology: frame.topology,
    points: await decode(frame.points, Uint16Array),
    speed: await bytes(frame.speed),
    stress: await bytes(frame.stress),
  };
}

// The motion with all its arrays decoded; `progress` is told the share that is done.
async function decodeMotion(motion, progress) {
  const topologies = [];
  for (const topology of motion.topologies) topologies.push(await decodeTopology(topology));
  const frames = [];
  for (const frame of motion.frames) {
    frames.push(await decodeFrame(frame));
    progress(frames.length / motion.frames.length);
  }
  return { ...motion, topologies, frames };
}
