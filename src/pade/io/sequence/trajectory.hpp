// Poses over time: the TUM text format (time tx ty tz qx qy qz qw), and the pose at any moment between two
// rows. Bad rows are skipped and named; a file without one good row is refused.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/skipped.hpp"

namespace pade::io {

struct StampedPose {
  Time time;
  Pose pose;  ///< T_world_camera or T_world_body; metres
};

/// Poses in rising order of time, no two of the same time.
class Trajectory {
 public:
  Trajectory() = default;
  /// Sorts; of rows with the same time the first is kept.
  explicit Trajectory(std::vector<StampedPose> rows);

  [[nodiscard]] const std::vector<StampedPose>& rows() const { return rows_; }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] bool empty() const { return rows_.empty(); }

  /// Pose at `time`, at constant body velocity on SE(3) between the two rows around it. A row within a
  /// microsecond (the resolution of stamps in text files) is taken as it is. Error if `time` lies outside
  /// the rows (nothing is extrapolated) or between rows more than `largest_gap` seconds apart.
  [[nodiscard]] Result<Pose> at(Time time, double largest_gap) const;

  /// Every pose T_a_b replaced by `left` * T_a_b * `right`.
  [[nodiscard]] Trajectory transformed(const Pose& left, const Pose& right) const;

 private:
  std::vector<StampedPose> rows_;
};

/// Collects the rows of a pose file of any format, keeps the good ones and names the bad.
class TrajectoryBuilder {
 public:
  explicit TrajectoryBuilder(std::string file) : file_(std::move(file)) {}

  /// A row as read: metres, and a quaternion x y z w. Skipped if a number is not finite, the quaternion is
  /// zero or its norm is more than 1 % from 1, or the time was seen before.
  void add(std::size_t line, Time time, const Eigen::Vector3d& translation, const Eigen::Vector4d& xyzw);
  /// A row that could not even be read.
  void skip(std::size_t line, const std::string& reason);

  /// The trajectory of the good rows. Error if there are none. Appends to `report`.
  Result<Trajectory> finish(ReadReport& report);

 private:
  struct Row {
    std::size_t line = 0;
    StampedPose pose;
  };
  std::string file_;
  std::vector<Row> rows_;
  std::vector<std::pair<std::size_t, std::string>> bad_;
};

/// Reads a TUM pose file: rows `time tx ty tz qx qy qz qw` (seconds, metres, Hamilton quaternion), separated
/// by blanks or commas; # starts a comment line.
Result<Trajectory> read_trajectory(const std::filesystem::path& file, ReadReport& report);
/// The same from text; `file` is the name in messages.
Result<Trajectory> parse_trajectory(std::string_view text, const std::string& file, ReadReport& report);

/// The text of a TUM pose file. Numbers are the shortest that read back to the same double; times keep the
/// nanosecond.
std::string format_trajectory(const std::vector<StampedPose>& rows);

}  // namespace pade::io
