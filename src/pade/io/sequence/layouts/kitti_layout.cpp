// The KITTI odometry layout: image_0/ (grey) or image_2/ (colour), times.txt, calib.txt, and the poses of
// camera 0 in poses.txt or, as the data set is unpacked, in ../../poses/<name of the sequence>.txt. Images
// are rectified.
#include <charconv>
#include <cmath>
#include <optional>

#include <Eigen/LU>
#include <fmt/format.h>

#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

/// The numbers of `fields` from `first` on, or nothing where one is not finite or their count is wrong.
std::optional<std::vector<double>> finite_numbers(const std::vector<std::string_view>& fields,
                                                  std::size_t first, std::size_t count) {
  if (fields.size() != first + count) return std::nullopt;
  std::vector<double> numbers;
  for (std::size_t i = first; i < fields.size(); ++i) {
    const auto number = parse_number(fields[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// One time per row; empty for a row that is no time, so that row numbers stay those of the images.
Result<std::vector<std::optional<Time>>> read_times(const fs::path& file, ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  std::vector<std::optional<Time>> times;
  for (const Line& line : data_lines(*text)) {
    times.push_back(parse_time(line.text));
    if (!times.back()) {
      report.skip(file.string(),
                  fmt::format("line {}: found {}, expected seconds", line.number, in_quotes(line.text)));
    }
  }
  return times;
}

std::vector<StampedFile> stamped_images(const fs::path& folder, const std::vector<std::optional<Time>>& times,
                                        ReadReport& report) {
  std::vector<StampedFile> images;
  for (const fs::path& file : image_files(folder)) {
    const std::string stem = file.stem().string();
    std::size_t row = 0;
    const auto [stop, status] = std::from_chars(stem.data(), stem.data() + stem.size(), row);
    if (status != std::errc{} || stop != stem.data() + stem.size() || row >= times.size() || !times[row]) {
      report.skip(file.string(),
                  fmt::format("found name {}, expected the number of a row of times.txt ({} rows)",
                              in_quotes(stem), times.size()));
      continue;
    }
    images.push_back({*times[row], file});
  }
  return images;
}

fs::path own_pose_file(const fs::path& folder) {
  if (path_exists(folder / "poses.txt")) return folder / "poses.txt";
  std::error_code failure;
  const fs::path absolute = fs::weakly_canonical(folder, failure);
  const fs::path standard =
      absolute.parent_path().parent_path() / "poses" / (absolute.filename().string() + ".txt");
  return path_exists(standard) ? standard : folder / "poses.txt";
}

Result<Trajectory> read_poses(const fs::path& file, const std::vector<std::optional<Time>>& times,
                              ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  const auto lines = data_lines(*text);
  if (lines.empty() || split_fields(lines.front().text).size() == 12) {
    return parse_kitti_poses(*text, file.string(), times, report);
  }
  std::vector<Time> images;
  for (const auto& time : times) images.push_back(time.value_or(Time{}));
  return parse_any_poses(*text, file.string(), images, report);  // another dialect, given by option
}

}  // namespace

Result<Trajectory> parse_kitti_poses(std::string_view text, const std::string& file,
                                     const std::vector<std::optional<Time>>& times, ReadReport& report) {
  TrajectoryBuilder builder(file);
  std::size_t row = 0;
  for (const Line& line : data_lines(text)) {
    const std::size_t i = row++;
    if (i >= times.size() || !times[i]) {
      builder.skip(line.number, fmt::format("row {} has no time in times.txt", i));
      continue;
    }
    const auto v = finite_numbers(split_fields(line.text), 0, 12);
    if (!v) {
      builder.skip(line.number, fmt::format("found {}, expected 12 finite numbers", in_quotes(line.text)));
      continue;
    }
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(v->data());
    const Eigen::Matrix3d R = T.leftCols<3>();
    constexpr double kTolerance = 1e-3;
    if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance) ||
        !(R.determinant() > 0)) {
      builder.skip(line.number, "the matrix is no rotation");
      continue;
    }
    builder.add(line.number, *times[i], T.col(3), Eigen::Quaterniond(R).normalized().coeffs());
  }
  return builder.finish(report);
}

Result<Calibration> parse_kitti_calibration(std::string_view text, const std::string& file, int camera) {
  const std::string key = fmt::format("P{}:", camera);
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    if (fields[0] != key) continue;
    const auto p = finite_numbers(fields, 1, 12);
    const bool good = p && (*p)[0] > 0 && (*p)[5] > 0 && (*p)[1] == 0 && (*p)[4] == 0 && (*p)[8] == 0 &&
                      (*p)[9] == 0 && (*p)[10] == 1;
    if (!good) {
      return Error{
          fmt::format("{}: line {}: field {} expected a 3x4 projection matrix fx 0 cx tx, 0 fy cy ty, 0 0 1 "
                      "tz with positive focal lengths",
                      file, line.number, key)};
    }
    Calibration calibration;
    calibration.format = "KITTI";
    const Camera lens{0, 0, (*p)[0], (*p)[5], (*p)[2], (*p)[6], Distortion::none, {}};
    calibration.camera = lens;
    // P = K [I | t] maps camera 0 to this camera, so that this camera sits at -t = -K^-1 p4 in camera 0.
    const double tz = (*p)[11];
    const Eigen::Vector3d t(((*p)[3] - lens.cx * tz) / lens.fx, ((*p)[7] - lens.cy * tz) / lens.fy, tz);
    calibration.T_body_camera = Pose{Eigen::Quaterniond::Identity(), -t};
    return calibration;
  }
  return Error{fmt::format("{}: field {} is missing, expected a 3x4 projection matrix", file, key)};
}

Result<SequenceListing> read_kitti_layout(const fs::path& folder, const LayoutChoice& choice,
                                          ReadReport& report) {
  SequenceListing listing;
  listing.layout = "KITTI odometry";
  int camera = 0;
  for (const int candidate :
       {3, 1, 2, 0}) {  // the last that is there is preferred: grey left, then colour left
    if (path_exists(folder / fmt::format("image_{}", candidate))) camera = candidate;
  }
  const auto text = read_file(folder / "calib.txt");
  if (!text) return text.error();
  auto own = parse_kitti_calibration(*text, (folder / "calib.txt").string(), camera);
  if (!own) return own.error();
  auto calibration = with_overrides(std::move(*own), folder, choice, report);
  if (!calibration) return calibration.error();
  listing.calibration = std::move(*calibration);

  const auto times = read_times(folder / "times.txt", report);
  if (!times) return times.error();
  listing.images = stamped_images(folder / fmt::format("image_{}", camera), *times, report);

  if (choice.computed) return listing;
  if (choice.poses == "original") {
    return Error{fmt::format(
        "{}: the KITTI layout has no original poses, expected groundtruth or a pose file", folder.string())};
  }
  listing.pose_file = choice.poses == "groundtruth" ? own_pose_file(folder) : fs::path(choice.poses);
  if (choice.poses == "groundtruth" && !path_exists(listing.pose_file))
    return Error{fmt::format("{}: no such file, {}", listing.pose_file.string(), kWherePosesComeFrom)};
  auto trajectory = read_poses(listing.pose_file, *times, report);
  if (!trajectory) return trajectory.error();
  listing.trajectory = std::move(*trajectory);
  listing.poses_of_body = true;  // the body is camera 0
  return listing;
}

}  // namespace pade::io
