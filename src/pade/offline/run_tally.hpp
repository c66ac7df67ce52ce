// Counts over a run what its hints look at: what the map was given and how the camera moved.
#pragma once

#include <cstdint>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/io/run/run_info.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

class RunTally {
 public:
  /// @param camera  of the frames, undistorted
  RunTally(const Camera& camera, const mapping::MapOptions& map) : camera_(camera), map_(map) {}

  /// @param update  with outcome `mapped`
  void add(const MapperUpdate& update);

  /// What the map holds now, and what it was given.
  [[nodiscard]] io::MapSummary map_summary(const mapping::OccupancyMap& map) const;
  [[nodiscard]] io::MotionSummary motion_summary() const;

 private:
  void add_depths(const DepthImage& depth);
  void add_motion(const RelativeMotion& motion);

  Camera camera_;
  mapping::MapOptions map_;
  io::MapSummary given_;
  std::uint64_t still_ = 0;
  std::vector<double> baselines_, rotation_sigmas_, direction_sigmas_;  // m, degrees
};

}  // namespace pade
