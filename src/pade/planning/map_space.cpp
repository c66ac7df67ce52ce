#include "pade/planning/map_space.hpp"

#include <limits>

namespace pade::planning {

double MapSpace::clear_length(std::span<const Eigen::Vector3d> path, double radius,
                              bool unknown_is_free) const {
  const auto unknown = unknown_is_free ? mapping::UnknownSpace::free : mapping::UnknownSpace::blocked;
  const auto hit = view_->sweep(path, radius, unknown);
  return hit ? hit->length : std::numeric_limits<double>::infinity();
}

}  // namespace pade::planning
