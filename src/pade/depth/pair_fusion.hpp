// One depth image from two pairs of frames with the same reference: a short baseline, which finds near and
// fast things, and a longer one, which is precise.
#pragma once

#include "pade/core/depth_image.hpp"

namespace pade::depth {

/// Fuses pixel by pixel, into `longer`. Both images have the same grid.
/// - Both have measured and agree: the depth of the longer baseline. They disagree (beyond 5 sigma of 1/Z and
///   a tenth): `inconsistent`, and the nearer of the bounds.
/// - Only the shorter one has measured (the match over the longer baseline is out of view, or failed): its
///   depth.
/// - Neither: the state and bound of the one whose bound reaches farther.
void fuse_pairs(const DepthImage& shorter, DepthImage& longer);

}  // namespace pade::depth
