// An hour of flight over new ground, ten images a second: what the map and the views of it take.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

#include "pade/core/random.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_border.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;

// What docs/mapping.md ("What a long flight takes") says of this flight, and a third more, in bytes.
constexpr double kMapPerMetre = 29e3;
constexpr double kViewPerMetre = 75e3;
constexpr double kWindow = 6e6;

/// Even ground with boards across the way, each in another place than all before it, seen by a camera that
/// looks ahead along x.
class EndlessGround {
 public:
  EndlessGround() {
    camera_.width = 80;
    camera_.height = 60;
    camera_.fx = camera_.fy = 70;
    camera_.cx = 39.5;
    camera_.cy = 29.5;
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Depth with normal noise of 1 % that its variance states.
  DepthImage seen_from(const Vector3d& place, Time time) {
    DepthImage image;
    image.time = time;
    image.depth = cv::Mat(camera_.height, camera_.width, CV_32FC1);
    for (int v = 0; v < camera_.height; ++v)
      for (int u = 0; u < camera_.width; ++u) {
        const double z = depth(place, -(u - camera_.cx) / camera_.fx, -(v - camera_.cy) / camera_.fy);
        image.depth.at<float>(v, u) = static_cast<float>(z * (1 + kNoise * random_.normal()));
      }
    image.variance = kNoise * kNoise * image.depth.mul(image.depth);
    return image;
  }

 private:
  static constexpr double kNoise = 0.01;
  static constexpr double kApart = 7;  // m, of the boards

  /// Of a board, 0 to 1: the same each time it is seen.
  static double drawn(long board, std::uint64_t what) {
    std::uint64_t x = static_cast<std::uint64_t>(board) * 0x9e3779b97f4a7c15U + what * 0xbf58476d1ce4e5b9U;
    x = (x ^ x >> 30U) * 0xbf58476d1ce4e5b9U;
    x = (x ^ x >> 27U) * 0x94d049bb133111ebU;
    return static_cast<double>((x ^ x >> 31U) >> 11U) * 0x1p-53;
  }
  /// @param y  to the left, @param z  upwards, both for each metre ahead
  [[nodiscard]] static double depth(const Vector3d& place, double y, double z) {
    const double ground = z < 0 ? place.z() / -z : std::numeric_limits<double>::quiet_NaN();
    for (long board = std::lround(std::floor(place.x() / kApart));; ++board) {
      const double ahead = kApart * (static_cast<double>(board) + 0.5 * drawn(board, 0)) - place.x();
      if (ahead < 0.1) continue;
      if (!(ahead < 40) || ahead > ground) return ground;
      const double aside = place.y() + y * ahead - 16 * (drawn(board, 1) - 0.5);
      const double height = place.z() + z * ahead;
      if (std::abs(aside) < 0.3 + 2 * drawn(board, 2) && height < 1 + 4 * drawn(board, 3)) return ahead;
    }
  }

  Camera camera_;
  Random random_{1};
};

/// Resident memory of this process, bytes.
double resident() {
  std::ifstream file("/proc/self/statm");
  double all = 0;
  double pages = 0;
  file >> all >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// What a planner keeps that needs only what lies around the vehicle: a view with a window that slides along.
class SlidingView {
 public:
  void update(const OccupancyMap& map, const MapChange& change, const Vector3d& place) {
    if (view_ != nullptr && (place - middle_).norm() < kSlide) {
      view_ = view_->after(map, change);
      return;
    }
    middle_ = place;
    view_ = MapView::of(map, {place.array() - kReach, place.array() + kReach});
  }
  [[nodiscard]] const MapView& view() const { return *view_; }
  [[nodiscard]] const Vector3d& middle() const { return middle_; }

  static constexpr double kReach = 40;  // m
  static constexpr double kSlide = 10;  // m

 private:
  std::shared_ptr<const MapView> view_;
  Vector3d middle_ = Vector3d::Zero();
};

/// A session as `pade live` has it: a map that packs what is far, begun anew where the border is near, and
/// the view of all of it that is saved and shown.
class LongFlight : public testing::Test {
 protected:
  static constexpr int kFrames = 36'000;
  static constexpr double kStep = 0.5;  // m from image to image: 5 m/s at 10 images a second

  LongFlight() {
    options_.pack_beyond = 50;
    Eigen::Matrix3d ahead;  // along x
    ahead << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    pose_.rotation = Eigen::Quaterniond(ahead);
    begin_anew({0, 0, 2});
  }
  void begin_anew(const Vector3d& place) {
    origin_ = place;
    map_.emplace(std::move(OccupancyMap::create(options_)).value());
    whole_ = MapView::of(*map_);
    near_ = {};
  }
  void fly(int frame) {
    const Vector3d place(kStep * frame, 0.3 * std::sin(0.05 * frame), 2 + 0.3 * std::sin(0.031 * frame));
    if (is_near_the_border(place - origin_, options_.voxel)) begin_anew({place.x(), 0, 0});
    pose_.translation = place - origin_;
    const MapChange change =
        map_->integrate(ground_.seen_from(place, Time{frame * 100'000'000LL}), ground_.camera(), pose_);
    EXPECT_EQ(change.outside, 0U);
    whole_ = whole_->after(*map_, change);
    near_.update(*map_, change, pose_.translation);
  }
  /// Within the window both views say the same.
  void expect_same_around() {
    for (int i = 0; i < 1000; ++i) {
      const double reach = SlidingView::kReach;
      const Vector3d at =
          near_.middle() + random_.uniform_zyx(Vector3d(-reach, -reach, -3), Vector3d(reach, reach, 3));
      ASSERT_EQ(near_.view().at(at), whole_->at(at)) << at.transpose();
    }
  }

  MapOptions options_;
  EndlessGround ground_;
  Pose pose_;
  Vector3d origin_ = Vector3d::Zero();
  std::optional<OccupancyMap> map_;
  std::shared_ptr<const MapView> whole_;
  SlidingView near_;
  Random random_{2};
};

TEST_F(LongFlight, OfAnHourTakesNoMoreThanItsMetresAndAWindowNoMoreThanItself) {
  double first_most = 0;  // resident, on the way to the first border
  double later_most = 0;
  std::size_t most_near = 0;
  int maps = 1;
  Vector3d origin = origin_;
  for (int frame = 0; frame < kFrames; ++frame) {
    fly(frame);
    if (origin_ != origin) ++maps;
    origin = origin_;
    if (frame % 500 != 499) continue;
    const double metres = pose_.translation.x();
    const auto of_map = static_cast<double>(map_->memory());
    const auto of_whole = static_cast<double>(whole_->memory());
    const std::size_t of_near = near_.view().memory();
    most_near = std::max(most_near, of_near);
    (maps == 1 ? first_most : later_most) = std::max(maps == 1 ? first_most : later_most, resident());
    EXPECT_LT(of_map, 25e6 + kMapPerMetre * metres) << metres << " m";
    EXPECT_LT(of_whole, 10e6 + kViewPerMetre * metres) << metres << " m";
    EXPECT_LT(static_cast<double>(of_near), kWindow) << metres << " m";
    expect_same_around();
    if (HasFailure()) return;
    if (maps == 1) {
      RecordProperty("metres", static_cast<int>(metres));
      RecordProperty("map_kB_per_metre",
                     static_cast<int>(1e-3 * static_cast<double>(map_->voxels().packed_memory()) / metres));
      RecordProperty("view_kB_per_metre", static_cast<int>(1e-3 * of_whole / metres));
    }
  }
  EXPECT_EQ(maps, 6);
  RecordProperty("window_kB", static_cast<int>(most_near / 1000));
  RecordProperty("resident_MB", static_cast<int>(1e-6 * std::max(first_most, later_most)));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which keep what was freed
  EXPECT_LT(later_most, 1.2 * first_most) << "maps that have ended leave something";
#endif
}

}  // namespace
}  // namespace pade::mapping
