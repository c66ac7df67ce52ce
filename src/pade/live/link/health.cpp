#include "pade/live/link/health.hpp"

namespace pade::live {

std::string_view text_of(Missing missing) {
  switch (missing) {
    case Missing::nothing:
      return "obstacle mapping active";
    case Missing::camera:
      return "no image from the camera";
    case Missing::clock:
      return "no TIMESYNC from the autopilot";
    case Missing::pose:
      return "no pose from the autopilot";
    case Missing::mapper:
      return "the mapper does not get on";
    case Missing::depth:
      return "no depth: no parallax (hover?) or no texture";
  }
  return "";
}

Missing missing_now(Time now, const Progress& progress, std::int64_t pose, bool synchronised) {
  const auto stale = [&](std::int64_t last) {
    return last == 0 || static_cast<double>(now.nanoseconds - last) * 1e-9 > kStale;
  };
  if (stale(progress.image)) return Missing::camera;
  if (!synchronised) return Missing::clock;
  if (stale(pose)) return Missing::pose;
  if (stale(progress.mapper)) return Missing::mapper;
  if (stale(progress.depth)) return Missing::depth;
  return Missing::nothing;
}

}  // namespace pade::live
