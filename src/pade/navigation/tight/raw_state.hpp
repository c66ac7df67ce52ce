// What the filter holds of a GNSS receiver: its clock, and the epoch from which phases are counted.
#pragma once

#include <array>
#include <cstdint>

#include "pade/core/sensors/raw_gnss.hpp"
#include "pade/navigation/filter_state.hpp"
#include "pade/navigation/measurement.hpp"

namespace pade::navigation {

inline constexpr std::size_t kMostSatellites = 40;  ///< of an epoch that are used

using ReceiverVector = Eigen::Matrix<double, kRawStates, 1>;  ///< in the order of filter_state.hpp

/// The part of the estimate that only raw GNSS needs.
struct ReceiverState {
  double clock = 0;                             ///< ahead of GPS time, m
  double drift = 0;                             ///< m/s
  Vector3d system_bias = Vector3d::Zero();      ///< of GLONASS, Galileo and BeiDou against GPS, m
  Vector3d anchor_position = Vector3d::Zero();  ///< of the antenna at the anchor, ENU, m
  double anchor_clock = 0;                      ///< of the clock then, m

  void retract(const ReceiverVector& error) {
    clock += error[0];
    drift += error[1];
    system_bias += error.segment<3>(2);
    anchor_position += error.segment<3>(5);
    anchor_clock += error[8];
  }
};

/// A satellite's phase at the anchor.
struct AnchoredPhase {
  gnss::SatelliteId satellite;
  std::array<char, 2> code{};
  Vector3d position = Vector3d::Zero();  ///< of the satellite, ENU, m
  double phase = 0;                      ///< m
  double sigma = 0;                      ///< m
  bool half_cycle = false;
  bool goes_on = false;  ///< no slip since
};

/// Part of the filter's state, kept and restored with it.
struct RawState {
  ReceiverState receiver;
  bool clock_known = false;
  std::array<bool, 3> system_known{};  ///< whose bias has been set
  std::array<AnchoredPhase, kMostSatellites> phases;
  std::size_t anchored = 0;  ///< of `phases`; 0: there is no anchor
  Time anchor_time;
  int contradictions = 0;  ///< epochs in a row most of whose rates were refused
  Time rates_agreed;       ///< last time that they were not
  Time ranges_agreed;      ///< the same of the ranges
  RawTally tally;          ///< since the start
};

}  // namespace pade::navigation
