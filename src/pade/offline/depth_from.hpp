// `--depth` of the program: which frames a depth image is made from, and how.
#pragma once

#include <array>
#include <string_view>
#include <utility>

#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

enum class DepthFrom { multi_view, two_view, pade, ttc };

/// Sets the mapper's options for it. pade and ttc are of one pair, as the paper has them.
inline void choose_depth(DepthFrom from, ObstacleMapperOptions& mapper) {
  switch (from) {
    case DepthFrom::multi_view:
      if (mapper.views.count == 0) mapper.views.count = ObstacleMapperOptions().views.count;
      return;
    case DepthFrom::two_view:
      mapper.views.count = 0;
      return;
    case DepthFrom::pade:
    case DepthFrom::ttc:
      mapper = one_pair(mapper);
      mapper.depth.method = from == DepthFrom::ttc ? depth::Method::ttc : depth::Method::pade;
  }
}

}  // namespace pade

template <>
struct pade::EnumNames<pade::DepthFrom> {
  static constexpr std::array names = {std::pair{pade::DepthFrom::multi_view, std::string_view("multi-view")},
                                       std::pair{pade::DepthFrom::two_view, std::string_view("two-view")},
                                       std::pair{pade::DepthFrom::pade, std::string_view("pade")},
                                       std::pair{pade::DepthFrom::ttc, std::string_view("ttc")}};
};
