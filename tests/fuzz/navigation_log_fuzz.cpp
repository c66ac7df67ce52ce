// Any text is either refused or gives finite navigation data. One target for each reader: PADE_READER is its
// name, set by the build.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pade/io/navigation/navigation_log.hpp"

#include "expect.hpp"

namespace {

using Remarks = std::vector<std::string>;

void imu(std::string_view text, Remarks& remarks) {
  const auto read = pade::io::parse_imu(text, "imu", remarks);
  if (!read) return;
  PADE_EXPECT(!read->empty());
  for (const auto& s : *read) PADE_EXPECT(s.angular_rate.allFinite() && s.specific_force.allFinite());
}

void gnss(std::string_view text, Remarks& remarks) {
  const auto read = pade::io::parse_gnss(text, "gnss", {}, remarks);
  if (!read) return;
  PADE_EXPECT(!read->fixes.empty() || !read->velocities.empty());
  for (const auto& fix : read->fixes) {
    PADE_EXPECT(fix.position.allFinite() && fix.covariance.allFinite());
    PADE_EXPECT((fix.covariance.diagonal().array() >= 0).all());
  }
  for (const auto& v : read->velocities) {
    PADE_EXPECT(v.velocity.allFinite() && v.covariance.allFinite());
    PADE_EXPECT((v.covariance.diagonal().array() >= 0).all());
  }
}

void barometer(std::string_view text, Remarks& remarks) {
  const auto read = pade::io::parse_barometer(text, "baro", remarks);
  if (!read) return;
  for (const auto& h : *read) PADE_EXPECT(std::isfinite(h.height) && std::isfinite(h.sigma));
}

void magnetometer(std::string_view text, Remarks& remarks) {
  const auto read = pade::io::parse_magnetometer(text, "mag", remarks);
  if (!read) return;
  for (const auto& m : *read) PADE_EXPECT(m.field.allFinite() && std::isfinite(m.sigma));
}

void check_states(const pade::Result<std::vector<pade::TrueState>>& read) {
  if (!read) return;
  for (const auto& s : *read) {
    PADE_EXPECT(s.T_world_body.is_finite() && std::abs(s.T_world_body.rotation.norm() - 1) < 1e-9);
  }
}

void truth(std::string_view text, Remarks& remarks) {
  check_states(pade::io::parse_truth(text, "truth", remarks));
}

void body_truth(std::string_view text, Remarks& remarks) {
  check_states(pade::io::parse_body_truth(text, "body_truth", remarks));
}

void stamps(std::string_view text, Remarks&) {
  const auto read = pade::io::parse_stamps(text, "stamps");
  PADE_EXPECT(!read || !read->empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Remarks remarks;
  PADE_READER(std::string_view(reinterpret_cast<const char*>(data), size), remarks);
  return 0;
}
