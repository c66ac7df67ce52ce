// Where depth and bounds need a look at the neighbourhood: edges, where the flow of two surfaces runs into
// each other, and what lies about wrong matches.
#pragma once

#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

/// Options of guard_edges().
struct EdgeOptions {
  int radius = 3;
  double nearness = 0.85;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("radius", self.radius, "pixels over which the flow mixes two surfaces; 0 = edges are not guarded");
    field("nearness", self.nearness,
          "a pixel beside one that is nearer than this share of its depth belongs to neither surface");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const EdgeOptions& options);

/// A flow method smears over some pixels: beside an obstacle lie depths between it and the background. Of the
/// pixels whose neighbourhood (2 radius + 1 pixels squared) holds one that is clearly nearer, no depth is
/// left (`inconsistent`), and every bound ends before that of the nearest measured pixel of its
/// neighbourhood, so that nothing is cleared behind the edge of what stands in front. Pixels of the nearer
/// surface keep their depth. Nothing within the radius of a pixel that was `inconsistent` before keeps a
/// bound.
void guard_edges(DepthImage& image, const EdgeOptions& options);

}  // namespace pade::depth
