// Clock and mounting of a camera from its images and the log of an IMU: `pade calibrate`.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/offline/calibration/turn_alignment.hpp"

namespace pade {

/// What was found.
struct ClockCalibration {
  TurnAlignment alignment;
  TurnTally images;            ///< what became of their pairs
  std::size_t unreadable = 0;  ///< images
  std::size_t gaps = 0;        ///< pairs too far apart in time to be compared
};

/// Opens the images of a sequence whose poses nobody needs. Errors: those of io::Sequence::open.
Result<io::Sequence> open_images(const std::filesystem::path& images, const io::SequenceOptions& options);

/// Looks at all images twice, or up to four times where the first look misled.
/// @param progress  called after every image with what is done and the total; false stops with
/// io::interrupted_error(). May be empty.
/// Errors: those of align_turns(), with what became of the images; more than half of the images unreadable.
Result<ClockCalibration> calibrate_clock(const io::Sequence& images, const std::vector<ImuSample>& imu,
                                         const std::function<bool(std::size_t, std::size_t)>& progress = {});

/// A rotation of the mounting that is known less well is not told, degrees (1 sigma).
inline constexpr double largest_mounting_sigma = 2;
/// A sentence for each axis of the body about which it is not.
std::vector<std::string> untold_axes(const TurnAlignment& alignment);

/// What a person should know of a result, one sentence each: axes of the mounting that no turn tells, drift,
/// how far the mounting is from that of the calibration.
std::vector<std::string> notes_on(const ClockCalibration& found, const std::optional<Pose>& T_body_camera);

}  // namespace pade
