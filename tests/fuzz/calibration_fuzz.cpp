// Any text is either refused by name or gives a camera that means something.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "pade/io/sequence/calibration.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first byte chooses a camera where a file holds several; it is part of the text, too.
  const int camera = size > 0 && data[0] % 5 == 4 ? 1 : 0;
  const auto read = pade::io::parse_calibration({reinterpret_cast<const char*>(data), size}, "input", camera);
  if (!read) {
    PADE_EXPECT(read.error().message.starts_with("input: "));
    return 0;
  }
  if (read->camera) {
    const pade::Camera& c = *read->camera;
    PADE_EXPECT(std::isfinite(c.fx) && std::isfinite(c.fy) && c.fx > 0 && c.fy > 0);
    PADE_EXPECT(std::isfinite(c.cx) && std::isfinite(c.cy) && c.width >= 0 && c.height >= 0);
    for (const double k : c.coefficients) PADE_EXPECT(std::isfinite(k));
    const auto ray = c.unproject({c.cx + 1, c.cy + 1});
    PADE_EXPECT(!ray || ray->z() == 1);
  }
  if (read->T_body_camera) PADE_EXPECT(std::abs(read->T_body_camera->rotation.norm() - 1) < 1e-9);
  if (read->world_up) PADE_EXPECT(std::abs(read->world_up->norm() - 1) < 1e-9);
  if (read->depth_scale) PADE_EXPECT(*read->depth_scale > 0);
  return 0;
}
