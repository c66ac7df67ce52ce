// How camera, calibration and mapper are.
#pragma once

#include <cstddef>
#include <string>

#include "bridge.hpp"
#include "counts.hpp"

namespace pade_ros {

/// One for each kind of reason: up to the first number in it.
std::string kind_of(const std::string& reason);

/// @{
/// `now` in seconds of a steady clock.
/// @param waiting  frames
Diagnosis diagnose_camera(const Counts& counts, const Topics& topics, std::size_t waiting, double now);
/// @param info    the newest message; null: none has come
/// @param problem  why it cannot be used; empty: it can
/// @param newest   image; null: none waits
Diagnosis diagnose_calibration(const Counts& counts, const Topics& topics, const CameraInfo* info,
                               const std::string& problem, const Image* newest, double now);
Diagnosis diagnose_mapper(const Counts& counts, double now);
/// @}

}  // namespace pade_ros
