// Bounds of patches without texture, from their outlines.
#pragma once

#include "pade/core/depth_image.hpp"

namespace pade::depth {

/// A patch without texture has no match, but it has an outline, and an outline moves like the nearer of the
/// two surfaces that meet there. A surface that covers the patch from one side to the other is therefore no
/// nearer, at either end, than the bounds that are met there; and along a straight line in the image the
/// inverse depth of a plane is linear. So each line through a pixel (of four) whose two ends meet bounds
/// gives one to the pixel: the inverse of what lies between the inverses. Where one end meets the edge of
/// something that stands in front that is too careful, not wrong; the pixel gets the second best of its
/// lines. With fewer than two lines it gets the least of all bounds that its eight rays meet, where these are
/// five or more, and where none meets a pixel whose own bound is unknown. A bound that the pixel has, where
/// it is greater, stays; so does its state (no_texture).
///
/// What this cannot see is a thing that has no contrast with what is around it along all of its outline, and
/// a bulge toward the camera without any shading.
void bound_by_outlines(DepthImage& image);

}  // namespace pade::depth
