// Bounds of patches without texture, from their outlines.
#pragma once

#include "pade/core/depth_image.hpp"

namespace pade::depth {

/// A patch without texture has no match, but it has an outline, and an outline belongs to the nearer of the
/// two surfaces that meet there. What stood before Z and covered a pixel of the patch would have to end in
/// every direction from it: there an edge would be seen that moves like something before Z. So the bound of
/// such a pixel is the least of those that its rays in eight directions meet first. None is set where one of
/// them first meets a pixel whose own bound is unknown, or where fewer than `kDirections` (5) meet any before
/// the border of the image. What this cannot see is a thing that has no contrast with what is around it along
/// all of its outline. The state stays no_texture.
void bound_by_outlines(DepthImage& image);

}  // namespace pade::depth
