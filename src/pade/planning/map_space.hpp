// The free space of a map, as the local planner asks for it.
#pragma once

#include <memory>
#include <utility>

#include "pade/mapping/query/map_view.hpp"
#include "pade/planning/free_space.hpp"

namespace pade::planning {

/// A picture of a map; sweeps are exact.
class MapSpace : public FreeSpace {
 public:
  /// Not null.
  explicit MapSpace(std::shared_ptr<const mapping::MapView> view) : view_(std::move(view)) {}

  [[nodiscard]] double clear_length(std::span<const Eigen::Vector3d> path, double radius,
                                    bool unknown_is_free) const override;

 private:
  std::shared_ptr<const mapping::MapView> view_;
};

}  // namespace pade::planning
