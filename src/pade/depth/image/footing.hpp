// Bounds of patches without texture, from what they stand on.
#pragma once

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

/// Options of bound_by_footing().
struct FootingOptions {
  bool on = false;        ///< off: nothing is done
  double headroom = 1.5;  ///< m above the camera; what is blank and hangs lower than this is not foreseen

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("on", self.on,
          "outdoors: what has no texture stands on what is seen below it, so that the sky over the ground is "
          "free");
    field("headroom", self.headroom, "free up to this height above the camera, m");
  }
};
/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const FootingOptions& options);

/// Things stand on the ground. A blank wall begins where the ground before it ends, and is as far ahead,
/// level, all the way up (as a depth only where the camera looks level); the sky begins at the horizon. So a
/// pixel without texture gets the lower quartile of the level distances of the bounds of the first pixels
/// with texture straight below it (along the vertical through the camera, which a banked camera sees aslant);
/// where fewer than half of them have a bound it gets that of the columns to both sides, since the patch is
/// one surface. A pixel that looks up is free only up to `headroom` above the camera, since a blank ceiling
/// comes nearer the farther one looks up. A bound that the pixel has, where it is greater, stays.
///
/// What this cannot see is a blank thing that hangs lower than `headroom` and has no contrast along its lower
/// edge, or one that leans toward the camera. Indoors, leave it off.
/// @param image    its `bound` is raised where the state is no_texture; nothing is done where it has no
/// bounds
/// @param camera   undistorted pinhole of the image
/// @param up       direction of up, camera axes, of length 1. Nothing is done where the camera looks more
/// than 60 degrees
///            up or down, or is banked by more than 45.
/// @param options  what check() accepts
void bound_by_footing(DepthImage& image, const Camera& camera, const Eigen::Vector3d& up,
                      const FootingOptions& options);

}  // namespace pade::depth
