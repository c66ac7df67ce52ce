#include "pade/live/link/health.hpp"

namespace pade::live {

std::string_view text_of(Missing missing) {
  switch (missing) {
    case Missing::nothing:
      return "obstacle mapping active";
    case Missing::autopilot:
      return "no HEARTBEAT from an autopilot";
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
    case Missing::view:
      return "nothing is seen at this height";
    case Missing::late:
      return "sectors are too old: the mapper is slow";
  }
  return "";
}

Missing missing_now(Time now, const Progress& progress, const LinkProgress& link) {
  constexpr double kAhead = 0.05;  // s: clocks differ by less
  const auto stale = [&](std::int64_t last) {
    const double age = static_cast<double>(now.nanoseconds - last) * 1e-9;
    return last == 0 || age > kStale || age < -kAhead;
  };
  if (stale(progress.image)) return Missing::camera;
  if (!link.synchronised) return Missing::clock;
  if (stale(link.pose)) return Missing::pose;
  if (stale(progress.mapper)) return Missing::mapper;
  if (stale(progress.depth)) return Missing::depth;
  if (link.empty > link.offered) return Missing::view;
  if (link.offered != 0 && stale(link.sent)) return Missing::late;
  return Missing::nothing;
}

}  // namespace pade::live
