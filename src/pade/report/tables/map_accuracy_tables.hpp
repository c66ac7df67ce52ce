// The measures of a map as people and programs read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pade/evaluation/map/map_accuracy.hpp"
#include "pade/evaluation/map/rigid_alignment.hpp"
#include "pade/evaluation/map/view_ahead.hpp"

namespace pade::evaluation {

/// A map with its surface and its phantoms.
struct MapMeasures {
  std::uint64_t occupied = 0, free = 0;  ///< voxels
  SurfaceShares surface;
  Phantoms phantoms;
};

/// Everything that `pade evaluate RUN --world W` says of a run.
struct MapAccuracy {
  std::size_t frames = 0;            ///< of the sequence
  std::size_t frames_with_pose = 0;  ///< of the run
  std::size_t frames_compared = 0;   ///< of them that have a true pose
  double voxel = 0, range = 0;       ///< of the run's map, m
  double seen_depth = 8;             ///< up to which surface counts as seen, m
  double clearance = 0;              ///< least distance of a true camera from the surface, m; at most 10
  std::optional<RigidAlignment> alignment;  ///< empty: none was asked for
  MapMeasures map;
  AheadShares ahead;                        ///< with the finished map
  std::optional<ViewAheadResult> replayed;  ///< with the map as it was at each frame
  std::optional<MapMeasures> ceiling;       ///< OctoMap with exact depth
  struct Reference {
    std::string run;
    std::size_t frames = 0;      ///< that it was mapped from: those that have a pose in the run
    std::uint64_t occupied = 0;  ///< voxels
  };
  std::optional<Reference> reference;
};

/// For a terminal.
std::string to_table(const MapAccuracy& accuracy);
/// An object; shares from 0 to 1, null if they are over nothing.
nlohmann::ordered_json json_of(const MapAccuracy& accuracy);

}  // namespace pade::evaluation
