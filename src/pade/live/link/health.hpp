// Whether what goes to the autopilot can be relied on, and if not, what is missing.
#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "pade/core/time.hpp"

namespace pade::live {

/// When the parts of a session last got on, by our clock, ns; 0: never. Any thread.
struct Progress {
  std::atomic<std::int64_t> image{0};   ///< start of exposure of the newest that came
  std::atomic<std::int64_t> mapper{0};  ///< the mapper's thread has gone round
  std::atomic<std::int64_t> depth{0};   ///< exposure of the newest frame that gave depth
};

/// The first input that is missing.
enum class Missing : std::uint8_t { nothing, camera, clock, pose, mapper, depth };

/// For the pilot: "no image from the camera".
std::string_view text_of(Missing missing);

/// Older than this is missing, s: with a heartbeat that follows at once it is said within 0.5 s.
inline constexpr double kStale = 0.4;

/// @param pose          time of the newest pose, ours, ns
/// @param synchronised  with the autopilot's clock
Missing missing_now(Time now, const Progress& progress, std::int64_t pose, bool synchronised);

}  // namespace pade::live
