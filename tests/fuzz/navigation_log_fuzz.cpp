// Any text is either refused or gives finite navigation data. The first byte chooses the reader.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pade/io/navigation_log.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::vector<std::string> remarks;
  switch (data[0] % 6) {
    case 0:
      if (const auto read = pade::io::parse_imu(text, "imu", remarks)) {
        for (const auto& s : *read) PADE_EXPECT(s.angular_rate.allFinite() && s.specific_force.allFinite());
      }
      break;
    case 1:
      if (const auto read = pade::io::parse_gnss(text, "gnss", {}, remarks)) {
        for (const auto& fix : read->fixes) PADE_EXPECT(fix.position.allFinite());
        for (const auto& velocity : read->velocities) PADE_EXPECT(velocity.velocity.allFinite());
      }
      break;
    case 2:
      (void)pade::io::parse_barometer(text, "baro", remarks);
      break;
    case 3:
      (void)pade::io::parse_magnetometer(text, "mag", remarks);
      break;
    case 4:
      if (const auto read = pade::io::parse_truth(text, "truth", remarks)) {
        for (const auto& s : *read) PADE_EXPECT(s.T_world_body.is_finite());
      }
      break;
    default:
      (void)pade::io::parse_stamps(text, "stamps");
      break;
  }
  return 0;
}
