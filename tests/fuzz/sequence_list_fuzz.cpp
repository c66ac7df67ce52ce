// Any text as an image list, as KITTI's calib.txt, and as the pieces that they are made of.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"
#include "pade/io/world.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace io = pade::io;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto lines = io::data_lines(text);
  io::ReadReport report;
  const auto images = io::parse_image_list(text, "folder/rgb.txt", 0, report);
  PADE_EXPECT(images.size() + report.skipped.size() == lines.size());
  const auto depth = io::parse_image_list(text, "folder/associations.txt", 2, report);
  PADE_EXPECT(depth.size() <= lines.size());
  const auto euroc = io::parse_euroc_images(text, "cam0/data.csv", report);
  PADE_EXPECT(euroc.size() <= lines.size());
  const auto kitti = io::parse_kitti_calibration(text, "calib.txt", 2);
  if (kitti) PADE_EXPECT(kitti->camera && kitti->camera->fx > 0 && std::isfinite(kitti->camera->cx));
  if (const auto time = pade::parse_time(text))
    PADE_EXPECT(pade::parse_time(pade::to_string(*time)) == *time);
  if (const auto up = io::parse_direction(text)) PADE_EXPECT(std::abs(up->norm() - 1) < 1e-9);
  return 0;
}
