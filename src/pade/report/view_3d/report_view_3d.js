// The 3-D views of a page: what their figures hold is drawn by View3d.

/// Every third bit of a number of 24.
function third (bits) {
  bits &= 0x249249
  bits = (bits | bits >> 2) & 0x0c30c3
  bits = (bits | bits >> 4) & 0x00f00f
  return (bits | bits >> 8) & 0x0000ff
}

/// encode_voxels() backwards: x, y, z and nothing of each cube.
function keysOf (text, count) {
  const bytes = window.atob(text)
  const keys = new Uint16Array(4 * count)
  let code = 0
  for (let i = 0, at = 0; i < count; ++i) {
    for (let scale = 1, byte = 128; byte > 127; scale *= 128) {
      byte = bytes.charCodeAt(at++)
      code += (byte & 127) * scale
    }
    const low = code % 0x1000000
    const high = (code - low) / 0x1000000
    for (let axis = 0; axis < 3; ++axis) keys[4 * i + axis] = third(low >> axis) | third(high >> axis) << 8
  }
  return keys
}

window.views3d = [...document.querySelectorAll('figure.map3d')].map((figure) => {
  const data = JSON.parse(figure.querySelector('script').textContent)
  const box = figure.querySelector('div')
  try {
    const view = new View3d(box, data)
    view.say(data.says)
    if (data.cubes > 0) view.setBlock(0, keysOf(data.keys, data.cubes), data.side, data.zero)
    for (const [name, way] of Object.entries(data.ways)) view.setLine(name, way.points, { colour: way.colour, width: 3 })
    view.labels = data.labels
    view.look('free')
    return view
  } catch (failure) {
    box.style.height = 'auto'
    box.querySelector('p').textContent = `Not drawn: ${failure.message}. The pictures of this page show the same map.`
    return null
  }
})
