// Any text is either refused or gives poses in order of time with unit quaternions, which survive being
// written and read again.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/sequence/trajectory.hpp"

#include "expect.hpp"

namespace {

using pade::io::ReadReport;
using pade::io::Trajectory;

void check(const pade::Result<Trajectory>& read) {
  if (!read) return;
  const auto& rows = read->rows();
  PADE_EXPECT(!rows.empty());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    PADE_EXPECT(rows[i].pose.is_finite() && std::abs(rows[i].pose.rotation.norm() - 1) < 1e-9);
    PADE_EXPECT(i == 0 || rows[i - 1].time < rows[i].time);
  }
  const auto middle = read->at(rows[rows.size() / 2].time, 1);
  PADE_EXPECT(middle);
  const pade::Time between{rows.front().time.nanoseconds / 2 + rows.back().time.nanoseconds / 2};
  const auto interpolated = read->at(between, 1e12);
  PADE_EXPECT(!interpolated || std::abs(interpolated->rotation.norm() - 1) < 1e-9);
  ReadReport report;
  const auto again = pade::io::parse_trajectory(pade::io::format_trajectory(rows), "again", report);
  PADE_EXPECT(again && again->size() == rows.size() && report.skipped.empty() && report.notes.empty());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    PADE_EXPECT(again->rows()[i].time == rows[i].time);
    PADE_EXPECT(again->rows()[i].pose.translation == rows[i].pose.translation);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  ReadReport report;
  switch (data[0] % 4) {
    case 0:
      check(pade::io::parse_trajectory(text, "input", report));
      break;
    case 1:
      check(pade::io::parse_euroc_poses(text, "input", report));
      break;
    case 2: {
      const std::vector<pade::Time> images = {pade::Time{0}, pade::Time{7}, pade::Time{5}};
      check(pade::io::parse_any_poses(text, "input", images, report));
      break;
    }
    default:
      check(pade::io::parse_kitti_poses(text, "input",
                                        {pade::Time{0}, pade::Time{7}, std::nullopt, pade::Time{5}}, report));
  }
  return 0;
}
