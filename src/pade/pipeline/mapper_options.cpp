// What the options of the obstacle mapper may be, and the sets of them that have a name.
#include <utility>

#include "pade/core/option_check.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

Status check(const ObstacleMapperOptions& o) {
  const OptionRange ranges[] = {
      {"step", static_cast<double>(o.step), 1, 1000},
      {"longest_step", static_cast<double>(o.longest_step), 1, 1000},
      {"prior_level", static_cast<double>(o.prior_level), -1, 16},
      {"largest_parallax", o.largest_parallax, 0, 1e6},
  };
  if (Status status = check_ranges(ranges); !status) return status;
  if (Status status = within("refinement", check(o.refinement)); !status) return status;
  if (Status status = within("alignment", check(o.alignment)); !status) return status;
  if (Status status = within("depth", check(o.depth)); !status) return status;
  if (Status status = within("edges", check(o.edges)); !status) return status;
  if (Status status = within("footing", check(o.footing)); !status) return status;
  if (Status status = within("views", check(o.views)); !status) return status;
  return within("map", check(o.map));
}

Status check(const ViewsOptions& o) {
  const OptionRange ranges[] = {
      {"count", static_cast<double>(o.count), 0, 16},
      {"frames", static_cast<double>(o.frames), 1, 1000},
  };
  if (Status status = check_ranges(ranges); !status) return status;
  if (Status status = within("flow", check(o.flow)); !status) return status;
  return within("depth", check(o.depth));
}

ObstacleMapperOptions one_pair(ObstacleMapperOptions options) {
  options.longest_step = 1;
  options.prior_level = -1;
  options.refinement.on = false;
  options.alignment.on = false;
  options.edges.radius = 0;
  options.outlines = false;
  options.views.count = 0;
  options.depth.flow_sigma_scale = 1;
  options.depth.flow_relative_sigma = 0;
  return options;
}

ObstacleMapperOptions as_printed(ObstacleMapperOptions options) {
  options = one_pair(std::move(options));
  options.flow = "dis-medium";
  options.depth.model = depth::Model::instantaneous;
  options.depth.reading = depth::Reading::samelson;
  options.derotation = depth::Derotation::flow;
  options.order = Order::first;
  options.depth.window = 4;
  return options;
}

}  // namespace pade
