// Any text is either refused by name or gives a flight whose path is finite everywhere.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "pade/simulation/flight/flight.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto flight = pade::simulation::parse_flight({reinterpret_cast<const char*>(data), size}, "input");
  if (!flight) {
    PADE_EXPECT(flight.error().message.starts_with("input"));
    return 0;
  }
  PADE_EXPECT(flight->frame_rate > 0 && flight->frames >= 0 && flight->blur_samples > 0);
  if (flight->camera) PADE_EXPECT(flight->camera->width > 0 && std::isfinite(flight->camera->fx));
  if (flight->waypoints.size() > 8) return 0;  // many waypoints take long and find nothing new
  const auto path = pade::simulation::Trajectory::through(flight->waypoints, flight->trajectory);
  if (!path || path->duration() > 60) return 0;
  for (const double share : {0.0, 0.3, 0.7, 1.0}) {
    const auto state = path->at(share * path->duration());
    PADE_EXPECT(state.position.allFinite() && state.velocity.allFinite() &&
                state.angular_velocity.allFinite());
    PADE_EXPECT(std::abs(state.R_world_body.norm() - 1) < 1e-9);
  }
  return 0;
}
