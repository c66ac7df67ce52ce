// A flight from one kind of storage into another: what a folder, a rosbag and an MCAP file have in common.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
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
  std::vector<std::string> notes;     ///< what became something else
};

/// Called before each image; false stops with interrupted_error().
using FlightProgress = std::function<bool(std::size_t done)>;

/// Usable frames, calibration, poses as they were read, mounting, a mask that is stated, the covariances of
/// motions, and the sensors of `log` (may be null), in the frame of the IMU where transforms tell it. The
/// offset between the clocks is taken out of poses and sensors. PNG and JPEG stay as they are; other images
/// become uncompressed ones. Errors: an image cannot be read, or its time is none of a recording (1970 to
/// 2038); the file cannot be written.
Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   RecordingWriter& writer, const FlightProgress& progress = {});

/// What the line of camera.yaml begins with that names the files and folders of a flight that was written,
/// so that what somebody added later is known.
inline constexpr std::string_view flight_files_line = "# files:";

/// The same as a folder in the TUM layout (docs/sequences.md), with the sensors in the axes of the body of
/// the poses, and without the covariances of motions.
Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   const OutputFolder& folder, const FlightProgress& progress = {});

}  // namespace pade::io
