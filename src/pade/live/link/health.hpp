// Whether what goes to the autopilot can be relied on, and if not, what is missing.
#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "pade/core/time.hpp"
#include "pade/live/shared_text.hpp"

namespace pade::live {

/// When the parts of a session last got on, by our clock, ns; 0: never. Any thread.
struct Progress {
  std::atomic<std::int64_t> image{0};   ///< start of exposure of the newest that came
  std::atomic<std::int64_t> mapper{0};  ///< the mapper's thread has gone round
  std::atomic<std::int64_t> depth{0};   ///< exposure of the newest frame that gave depth
  SharedText no_image;                  ///< why none comes, where the camera knows it; else empty
};

/// The first input that is missing.
enum class Missing : std::uint8_t {
  nothing,
  autopilot,  ///< no heartbeat has come yet, so nothing can be sent either
  camera,
  clock,
  pose,
  mapper,
  depth,
  view,  ///< there is depth, but not at the vehicle's height
  late,  ///< sectors are older than they may be when their turn comes
};

/// For the pilot: "no image from the camera".
std::string_view text_of(Missing missing);

/// Older than this is missing, s: with a heartbeat that follows at once it is said within 0.5 s.
inline constexpr double kStale = 0.4;

/// What only the link knows of. Times are ours, ns; 0: never.
struct LinkProgress {
  bool synchronised = false;  ///< with the autopilot's clock
  std::int64_t pose = 0;      ///< of the newest pose
  std::int64_t empty = 0;     ///< frame of the newest sectors that say nothing; they are not sent
  std::int64_t offered = 0;   ///< of the newest that say something
  std::int64_t sent = 0;      ///< of the newest that were sent
};

/// A time in the future is as bad as an old one: it is of another clock.
Missing missing_now(Time now, const Progress& progress, const LinkProgress& link);

}  // namespace pade::live
