// A recorded drive through a street canyon: raw ranges and odometry, no IMU.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/navigation/odometry/planar_run.hpp"

namespace pade::navigation {
namespace {

namespace fs = std::filesystem;
const fs::path kRecording = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation/smartloc_berlin_potsdamer";

struct Spread {
  double median = 0, rms = 0, most = 0;  ///< horizontal, m; `most` holds 95 %
  double nees = 0;                       ///< of two degrees of freedom
};

/// Horizontal errors of the epochs of a span of time.
class Errors {
 public:
  void add(Time time, const Vector3d& enu, const Matrix3d& covariance) {
    const Eigen::Vector2d e = enu.head<2>();
    rows_.push_back({time.seconds(), e.norm(), e.dot(covariance.topLeftCorner<2, 2>().ldlt().solve(e))});
  }
  [[nodiscard]] Spread between(double from, double to) const {
    Spread s;
    std::vector<double> sizes;
    for (const Row& row : rows_) {
      if (row.time < from || row.time >= to) continue;
      sizes.push_back(row.size);
      s.rms += row.size * row.size;
      s.nees += row.nees;
    }
    std::sort(sizes.begin(), sizes.end());
    const auto count = static_cast<double>(sizes.size());
    if (sizes.empty()) return s;
    s.median = sizes[sizes.size() / 2];
    s.most = sizes[sizes.size() * 95 / 100];
    s.rms = std::sqrt(s.rms / count);
    s.nees /= count;
    return s;
  }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }

 private:
  struct Row {
    double time, size, nees;
  };
  std::vector<Row> rows_;
};

class StreetCanyon : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kRecording)) GTEST_SKIP() << kRecording << " is not here";
    auto log = io::read_raw_gnss(kRecording);
    ASSERT_TRUE(log) << log.error().message;
    log_ = *log;
    ASSERT_EQ(log_.truth.size(), 1372U);
    ASSERT_EQ(log_.known_ranges.size(), 1372U);
    ASSERT_EQ(log_.odometry.size(), 1372U);
  }
  [[nodiscard]] Vector3d truth_at(Time time) const {
    const auto at = std::lower_bound(log_.truth.begin(), log_.truth.end(), time,
                                     [](const gnss::TruePosition& p, Time t) { return p.time < t; });
    EXPECT_TRUE(at != log_.truth.end() && at->time == time);
    return at->position;
  }
  [[nodiscard]] Errors single_point() const {
    Errors errors;
    for (const gnss::EpochResult& e : gnss::run_raw(log_, {}).epochs) {
      if (!e.position) continue;
      const Vector3d truth = truth_at(e.time);
      const Matrix3d axes = gnss::enu_axes(gnss::geodetic_of(truth));
      errors.add(e.time, axes * (e.position->position - truth),
                 axes * e.position->covariance * axes.transpose());
    }
    return errors;
  }
  [[nodiscard]] Errors filtered(PlanarCoupling coupling, const PlanarOptions& options = {},
                                const gnss::PositioningOptions& positioning = {}) const {
    const PlanarRun run = run_planar(log_, positioning, options, coupling);
    Errors errors;
    for (const PlanarFrame& f : run.frames) {
      const Vector3d truth = run.place->R_enu_ecef * (truth_at(f.estimate.time) - run.place->origin);
      errors.add(f.estimate.time, f.estimate.position - truth, f.estimate.covariance);
    }
    EXPECT_TRUE(run.yaw_found);
    if (run.yaw_found) std::printf("yaw known after %.1f s; ", run.yaw_found->seconds());
    if (!run.frames.empty()) {
      const PlanarEstimate& last = run.frames.back().estimate;
      std::printf("at the end: scale %.4f ± %.4f, bias %.4f rad/s, drift %.2f m/s, yaw ± %.2f°\n", last.scale,
                  last.scale_sigma, last.yaw_rate_bias, last.drift, last.yaw_sigma * 180 / M_PI);
    }
    std::printf("  ranges: %zu counted, %zu doubted, %zu refused; %zu times believed anew\n",
                static_cast<std::size_t>(run.tally.counted), static_cast<std::size_t>(run.tally.doubted),
                static_cast<std::size_t>(run.tally.refused), static_cast<std::size_t>(run.tally.reacquired));
    return errors;
  }
  gnss::RawLog log_;
};

constexpr double kHalf = 141.4;  // s; all constants were chosen on what lies before
constexpr double kEnd = 1e9;

void print(const char* what, const Errors& errors) {
  for (const auto& [name, from, to] :
       {std::tuple("all", 0.0, kEnd), {"first half", 0.0, kHalf}, {"second half", kHalf, kEnd}}) {
    const Spread s = errors.between(from, to);
    std::printf("%-14s %-12s horizontal: median %5.2f m, rms %5.2f m, 95 %% %5.2f m; NEES (2) %.1f\n", what,
                name, s.median, s.rms, s.most, s.nees);
    testing::Test::RecordProperty(std::string(what) + " " + name, std::to_string(s.rms));
  }
}

TEST_F(StreetCanyon, TightIsBetterThanLooseIsBetterThanSinglePoints) {
  const Errors alone = single_point();
  const Errors loose = filtered(PlanarCoupling::loose);
  const Errors tight = filtered(PlanarCoupling::tight);
  print("single point", alone);
  print("loose", loose);
  print("tight", tight);
  EXPECT_EQ(alone.size(), 1372U);
  EXPECT_EQ(loose.size(), 1372U);
  EXPECT_EQ(tight.size(), 1372U);
  for (const auto& [from, to] : {std::pair(0.0, kEnd), {0.0, kHalf}, {kHalf, kEnd}}) {
    EXPECT_LT(tight.between(from, to).rms, loose.between(from, to).rms);
    EXPECT_LT(loose.between(from, to).rms, alone.between(from, to).rms);
    EXPECT_LT(tight.between(from, to).rms, 17);
    EXPECT_LT(tight.between(from, to).nees, 5);
  }
}

}  // namespace
}  // namespace pade::navigation
