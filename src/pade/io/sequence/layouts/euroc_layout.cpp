// The EuRoC MAV layout (ASL data set format): mav0/cam0/data.csv and sensor.yaml, and the body's poses in
// mav0/state_groundtruth_estimate0 or mav0/vicon0. Times are integer nanoseconds, quaternions w x y z.
#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"
#include "pade/io/yaml.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

std::optional<Time> parse_nanoseconds(std::string_view text) {
  Time time;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, time.nanoseconds);
  constexpr std::int64_t kLargest = 4'600'000'000'000'000'000;  // as parse_time: every difference fits
  if (status != std::errc{} || stop != end || time.nanoseconds > kLargest || time.nanoseconds < -kLargest) {
    return std::nullopt;
  }
  return time;
}

/// T_body_sensor of a sensor.yaml that describes no camera.
Result<Pose> read_mounting(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return text.error();
  const auto root = parse_yaml(*text, file.string());
  if (!root) return root.error();
  CalibrationFields fields(*root, file.string());
  fields.require({"T_BS"}, "the transform from the sensor to the body, 4x4 by rows");
  const auto transform = fields.transform("T_BS");
  if (fields.error()) return *fields.error();
  return *transform;
}

Result<Trajectory> read_euroc_poses(const fs::path& file, ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_euroc_poses(*text, file.string(), report);
}

/// The poses of the body, and the file they are in.
Result<Trajectory> choose_poses(const fs::path& mav, const std::string& choice, std::span<const Time> images,
                                fs::path& file, ReadReport& report) {
  if (choice == "original") {
    return Error{fmt::format(
        "{}: the EuRoC layout has no original poses, expected groundtruth or a pose file", mav.string())};
  }
  if (choice != "groundtruth") {
    file = choice;
    return read_any_poses(file, images, report);
  }
  file = mav / "state_groundtruth_estimate0" / "data.csv";
  if (path_exists(file)) return read_euroc_poses(file, report);
  file = mav / "vicon0" / "data.csv";
  if (path_exists(file)) {
    const auto T_body_vicon = read_mounting(mav / "vicon0" / "sensor.yaml");
    if (!T_body_vicon) return T_body_vicon.error();
    auto T_world_vicon = read_euroc_poses(file, report);
    if (!T_world_vicon) return T_world_vicon;
    return T_world_vicon->transformed(Pose{}, T_body_vicon->inverse());
  }
  file = mav / "mocap0" / "data.csv";  // TUM-VI: poses of the IMU
  if (path_exists(file)) return read_euroc_poses(file, report);
  const bool leica = path_exists(mav / "leica0" / "data.csv");
  return Error{
      fmt::format("{}: {}, expected state_groundtruth_estimate0/data.csv, vicon0/data.csv or mocap0/data.csv",
                  mav.string(), leica ? "leica0 has positions without orientation" : "no poses")};
}

}  // namespace

Result<Trajectory> parse_euroc_poses(std::string_view text, const std::string& file, ReadReport& report) {
  TrajectoryBuilder builder(file);
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    if (fields.size() < 8) {
      builder.skip(line.number, fmt::format("found {} fields, expected time, position and quaternion w x y z",
                                            fields.size()));
      continue;
    }
    const auto time = parse_nanoseconds(fields[0]);
    if (!time) {
      builder.skip(line.number,
                   fmt::format("found time {}, expected whole nanoseconds", in_quotes(fields[0])));
      continue;
    }
    Eigen::Matrix<double, 7, 1> v;
    std::size_t read = 0;
    for (; read < 7; ++read) {
      const auto number = parse_number(fields[read + 1]);
      if (!number) break;
      v[static_cast<Eigen::Index>(read)] = *number;
    }
    if (read < 7) {
      builder.skip(line.number, fmt::format("found {}, expected a number", in_quotes(fields[read + 1])));
      continue;
    }
    builder.add(line.number, *time, v.head<3>(), {v[4], v[5], v[6], v[3]});
  }
  return builder.finish(report);
}

std::vector<StampedFile> parse_euroc_images(std::string_view text, const fs::path& file, ReadReport& report) {
  std::vector<StampedFile> images;
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    const auto time = parse_nanoseconds(fields[0]);
    if (fields.size() < 2 || !time || fields[1].empty()) {
      report.skip(file.string(),
                  fmt::format("line {}: found {}, expected a time in nanoseconds and a file name",
                              line.number, in_quotes(line.text)));
      continue;
    }
    images.push_back({*time, file.parent_path() / "data" / fields[1]});
  }
  return images;
}

Result<SequenceListing> read_euroc_layout(const fs::path& folder, const LayoutChoice& choice,
                                          ReadReport& report) {
  const fs::path mav = path_exists(folder / "mav0") ? folder / "mav0" : folder;
  const fs::path camera = mav / "cam0";
  SequenceListing listing;
  listing.layout = "EuRoC";
  Calibration own;
  if (path_exists(camera / "sensor.yaml") || choice.calibration_file.empty()) {
    auto read = read_calibration(camera / "sensor.yaml");
    if (!read) return read.error();
    own = std::move(*read);
  }
  auto calibration = with_overrides(std::move(own), folder, choice, report);
  if (!calibration) return calibration.error();
  listing.calibration = std::move(*calibration);

  const auto text = read_file(camera / "data.csv");
  if (!text) return text.error();
  listing.images = parse_euroc_images(*text, camera / "data.csv", report);

  if (choice.computed) return listing;
  std::vector<Time> times;
  for (const StampedFile& image : listing.images) times.push_back(image.time);
  auto trajectory = choose_poses(mav, choice.poses, times, listing.pose_file, report);
  if (!trajectory) return trajectory.error();
  listing.trajectory = std::move(*trajectory);
  listing.poses_of_body = listing.calibration.pose_convention != PoseConvention::camera_to_world_optical;
  listing.world_up = WorldUp{Eigen::Vector3d::UnitZ(), true, "EuRoC layout"};  // worlds are levelled, z up
  return listing;
}

}  // namespace pade::io
