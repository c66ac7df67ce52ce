// Where depth and bounds need a look at the neighbourhood: edges, where the flow of two surfaces runs into
// each other, and the epipole, where nothing has parallax.
#pragma once

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

struct EdgeOptions {
  int radius = 3;
  double nearness = 0.85;
  double hole = 0.05;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("radius", self.radius, "pixels over which the flow mixes two surfaces; 0 = edges are not guarded");
    field("nearness", self.nearness,
          "a pixel beside one that is nearer than this share of its depth belongs to neither surface");
    field("hole", self.hole, "what is smaller than this is not looked for at the epipole, m");
  }
};

Status check(const EdgeOptions& options);

/// A flow method smears over some pixels: beside an obstacle lie depths between it and the background. Of the
/// pixels whose neighbourhood (2 radius + 1 pixels squared) holds one that is clearly nearer, no depth is
/// left (`inconsistent`), and every bound ends before that of the nearest measured pixel of its
/// neighbourhood, so that nothing is cleared behind the edge of what stands in front. Pixels of the nearer
/// surface keep their depth.
void guard_edges(DepthImage& image, const EdgeOptions& options);

/// The bounds fall to zero at the epipole, however far everything is. But a thing that lies within R pixels
/// of it at depth Z is no larger than 2 R Z / f. So up to Z = f hole / (2 R), R being the least radius at
/// which all pixels of the ring are bounded at least that far, nothing larger than `hole` is there: the
/// textured, matched pixels within R that have no depth get that bound. Nothing is done where the epipole is
/// outside the image, or R beyond 24 px.
/// @param image  window 1, of the reference of `motion`. @param hole  m; 0 = left as it is
void close_epipole(DepthImage& image, const Camera& camera, const RelativeMotion& motion, double hole);

}  // namespace pade::depth
