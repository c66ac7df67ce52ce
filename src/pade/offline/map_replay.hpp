// A run once more, in memory: what its map knew after each frame.
#pragma once

#include <functional>

#include "pade/core/frame.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/offline/map_sequence.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

/// Maps the frames of `sequence` that `wanted` names (empty: all), as map_sequence() does with the same
/// options, and writes nothing.
/// @param after  called for every frame that the mapper took, once the map has it; false stops with
///               io::interrupted_error(). May be empty.
/// @return the mapper with the finished map
Result<ObstacleMapper> replay_map(const io::Sequence& sequence, const MapSequenceOptions& options,
                                  const std::function<bool(Time)>& wanted,
                                  const std::function<bool(const Frame&, const ObstacleMapper&)>& after);

}  // namespace pade
