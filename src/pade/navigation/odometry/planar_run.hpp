// A recording of raw GNSS and odometry, played through the planar filter.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "pade/navigation/gnss/positioning.hpp"
#include "pade/navigation/odometry/planar_filter.hpp"
#include "pade/navigation/tight/raw_observer.hpp"

namespace pade::navigation {

/// How the satellites reach the filter.
enum class PlanarCoupling : std::uint8_t {
  tight,  ///< each range for itself
  loose,  ///< the position that each epoch gives alone, with its covariance
};

/// The filter behind one epoch.
struct PlanarFrame {
  PlanarEstimate estimate;
  std::vector<RangeShare> shares;  ///< of the satellites; loose: empty
  double fix_share = 0;            ///< of the position; tight: 0
};

struct PlanarRun {
  std::vector<PlanarFrame> frames;  ///< of each epoch from the first position on, causal
  std::optional<LocalFrame> place;  ///< of east, north and up; empty without any position
  PlanarTally tally;
  std::size_t before_start = 0;      ///< epochs before a position to start from
  std::size_t starts = 0;            ///< one, and one for each epoch a minute behind the last odometry
  std::size_t without_position = 0;  ///< loose: epochs that gave none and so nothing
  std::size_t outside = 0;           ///< epochs before the first or a gap behind the last odometry: not used
  std::optional<Time> yaw_found;     ///< when the yaw was known first
};

/// Plays the known ranges of a log with its odometry, in the order of the stamps; of one stamp the odometry
/// is first.
PlanarRun run_planar(const gnss::RawLog& log, const gnss::PositioningOptions& positioning,
                     const PlanarOptions& options, PlanarCoupling coupling);

}  // namespace pade::navigation
