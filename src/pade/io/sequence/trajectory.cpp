#include "pade/io/sequence/trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr std::int64_t kStampResolution = 1000;  // nanoseconds: text stamps have six decimals
constexpr double kNormTolerance = 0.01;

/// Empty where the row is good.
std::string defect(const Eigen::Vector3d& translation, const Eigen::Vector4d& xyzw) {
  if (!translation.allFinite() || !xyzw.allFinite()) {
    return "the pose has a number that is not finite";
  }
  const double norm = xyzw.norm();
  if (norm < 1e-6) return "the quaternion is zero, expected unit norm";
  if (!(std::abs(norm - 1) <= kNormTolerance)) {
    return fmt::format("the quaternion has norm {:.6g}, expected 1", norm);
  }
  return {};
}

}  // namespace

Trajectory::Trajectory(std::vector<StampedPose> rows) : rows_(std::move(rows)) {
  std::stable_sort(rows_.begin(), rows_.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.time < b.time; });
  const auto same_time = [](const StampedPose& a, const StampedPose& b) { return a.time == b.time; };
  rows_.erase(std::unique(rows_.begin(), rows_.end(), same_time), rows_.end());
}

Result<Pose> Trajectory::at(Time time, double largest_gap) const {
  const auto after = std::lower_bound(rows_.begin(), rows_.end(), time,
                                      [](const StampedPose& row, Time t) { return row.time < t; });
  const auto is_now = [&](const StampedPose& row) {
    return std::abs(seconds_between(row.time, time)) <= 1e-9 * kStampResolution;
  };
  if (after != rows_.end() && is_now(*after)) return after->pose;
  if (after != rows_.begin() && is_now(*std::prev(after))) return std::prev(after)->pose;
  if (rows_.empty()) return Error{"there are no poses"};
  if (after == rows_.begin() || after == rows_.end()) {
    const double apart =
        std::max(seconds_between(time, rows_.front().time), seconds_between(rows_.back().time, time));
    constexpr double kAnother = 10;  // s
    return Error{
        fmt::format("time {} lies outside the poses, which cover {} to {}{}", to_string(time),
                    to_string(rows_.front().time), to_string(rows_.back().time),
                    apart > kAnother ? " (of another flight, or of a clock with another zero?)" : "")};
  }
  const StampedPose& before = *std::prev(after);
  const double gap = seconds_between(before.time, after->time);
  if (gap > largest_gap) {
    // Whole numbers that rise by 10 to 1000 are how cameras count milliseconds.
    const bool whole = gap >= 10 && gap <= 1000 && std::abs(gap - std::round(gap)) < 1e-9;
    return Error{fmt::format(
        "time {} lies in a gap of {:.3f} s between poses, expected at most {:g} s{}", to_string(time), gap,
        largest_gap, whole ? " (stamps in milliseconds? write seconds, or [ms] into a heading)" : "")};
  }
  return interpolate(before.pose, after->pose, seconds_between(before.time, time) / gap);
}

Trajectory Trajectory::transformed(const Pose& left, const Pose& right) const {
  Trajectory out = *this;
  for (StampedPose& row : out.rows_) row.pose = left * row.pose * right;
  return out;
}

void TrajectoryBuilder::add(std::size_t line, Time time, const Eigen::Vector3d& translation,
                            const Eigen::Vector4d& xyzw) {
  if (const std::string why = defect(translation, xyzw); !why.empty()) return skip(line, why);
  // One that is of unit length but for rounding stays as it is, so that what is written is read back.
  constexpr double kRounding = 1e-15;
  Eigen::Quaterniond rotation(xyzw);
  if (std::abs(xyzw.squaredNorm() - 1) > kRounding) rotation.normalize();
  rows_.push_back({line, {time, {rotation, translation}}});
}

void TrajectoryBuilder::skip(std::size_t line, const std::string& reason) { bad_.emplace_back(line, reason); }

Result<Trajectory> TrajectoryBuilder::finish(ReadReport& report) {
  const auto earlier = [](const Row& a, const Row& b) { return a.pose.time < b.pose.time; };
  if (!std::is_sorted(rows_.begin(), rows_.end(), earlier)) {
    std::stable_sort(rows_.begin(), rows_.end(), earlier);
    report.notes.push_back(fmt::format("{}: the rows were not in order of time and have been sorted", file_));
  }
  std::vector<StampedPose> good;
  good.reserve(rows_.size());
  for (const Row& row : rows_) {
    if (!good.empty() && good.back().time == row.pose.time) {
      skip(row.line, fmt::format("time {} was seen before", to_string(row.pose.time)));
    } else {
      good.push_back(row.pose);
    }
  }
  std::stable_sort(bad_.begin(), bad_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (good.empty()) {
    const std::string why =
        bad_.empty() ? "it is empty" : fmt::format("first: line {}: {}", bad_[0].first, bad_[0].second);
    return Error{
        fmt::format("{}: no usable pose in {} rows ({}), expected rows of time, position and unit "
                    "quaternion (time tx ty tz qx qy qz qw; other dialects: docs/formats.md)",
                    file_, bad_.size(), why)};
  }
  for (const auto& [line, reason] : bad_) report.skip(file_, fmt::format("line {}: {}", line, reason));
  return Trajectory(std::move(good));
}

Result<Trajectory> read_trajectory(const std::filesystem::path& file, ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_trajectory(*text, file.string(), report);
}

Result<Trajectory> parse_trajectory(std::string_view text, const std::string& file, ReadReport& report) {
  TrajectoryBuilder builder(file);
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    if (fields.size() != 8) {
      builder.skip(line.number,
                   fmt::format("found {} fields, expected 8 (time tx ty tz qx qy qz qw)", fields.size()));
      continue;
    }
    const auto time = parse_time(fields[0]);
    if (!time) {
      builder.skip(line.number, fmt::format("found time {}, expected seconds", in_quotes(fields[0])));
      continue;
    }
    Eigen::Matrix<double, 7, 1> numbers;
    std::size_t read = 0;
    for (; read < 7; ++read) {
      const auto number = parse_number(fields[read + 1]);
      if (!number) break;
      numbers[static_cast<Eigen::Index>(read)] = *number;
    }
    if (read < 7) {
      builder.skip(line.number, fmt::format("found {}, expected a number", in_quotes(fields[read + 1])));
      continue;
    }
    builder.add(line.number, *time, numbers.head<3>(), numbers.tail<4>());
  }
  return builder.finish(report);
}

std::string format_trajectory(const std::vector<StampedPose>& rows) {
  std::string text = "# time tx ty tz qx qy qz qw (seconds, metres, Hamilton quaternion)\n";
  for (const auto& [time, pose] : rows) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    text += fmt::format("{} {} {} {} {} {} {} {}\n", to_string(time), t.x(), t.y(), t.z(), q.x(), q.y(),
                        q.z(), q.w());
  }
  return text;
}

}  // namespace pade::io
