// A flight from one kind of storage into another: what a folder, a rosbag and an MCAP file have in common.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/recording_writer.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::io {

/// What was written.
struct WrittenFlight {
  std::size_t images = 0, poses = 0, imu = 0, fixes = 0;
  std::vector<std::string> left_out;  ///< what the format has no place for, or nobody could read
};

/// Called before each image; false stops with interrupted_error().
using FlightProgress = std::function<bool(std::size_t done)>;

/// Usable frames, calibration, poses as they were read, mounting, and the sensors of `log` (may be null). PNG
/// and JPEG stay as they are; other images become uncompressed ones. Errors: an image cannot be read; the
/// file cannot be written.
Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   RecordingWriter& writer, const FlightProgress& progress = {});

/// The same as a folder in the TUM layout (docs/sequences.md).
Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   const OutputFolder& folder, const FlightProgress& progress = {});

}  // namespace pade::io
