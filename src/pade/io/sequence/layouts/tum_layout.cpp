// The TUM RGB-D layout: rgb/, depth/, rgb.txt, depth.txt or associations.txt, groundtruth.txt, camera.yaml.
#include <algorithm>
#include <cctype>
#include <system_error>

#include <fmt/format.h>

#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

Result<std::vector<StampedFile>> read_image_list(const fs::path& file, std::size_t column,
                                                 ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_image_list(*text, file, column, report);
}

/// Image files whose names are their times, in order of time: as text 10.1 would come before 2.9.
std::vector<StampedFile> files_named_by_time(const fs::path& folder, ReadReport& report) {
  std::vector<StampedFile> files;
  for (const fs::path& file : image_files(folder)) {
    const std::string stem = file.stem().string();
    if (const auto time = parse_time(stem)) {
      files.push_back({*time, file});
    } else {
      report.skip(file.string(), fmt::format("found name {}, expected the time in seconds", in_quotes(stem)));
    }
  }
  std::stable_sort(files.begin(), files.end(),
                   [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; });
  return files;
}

Result<std::vector<StampedFile>> list_images(const fs::path& folder, const char* kind, std::size_t column,
                                             ReadReport& report) {
  const std::string list = fmt::format("{}.txt", kind);
  if (path_exists(folder / list)) return read_image_list(folder / list, 0, report);
  if (path_exists(folder / "associations.txt"))
    return read_image_list(folder / "associations.txt", column, report);
  return files_named_by_time(folder / kind, report);
}

fs::path pose_file(const fs::path& folder, const std::string& poses) {
  if (poses == "groundtruth") return folder / "groundtruth.txt";
  if (poses == "original") return folder / "groundtruth_original.txt";
  return poses;
}

}  // namespace

std::vector<StampedFile> parse_image_list(std::string_view text, const fs::path& file, std::size_t column,
                                          ReadReport& report) {
  std::vector<StampedFile> images;
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    const auto time = column < fields.size() ? parse_time(fields[column]) : std::nullopt;
    if (!time || column + 1 >= fields.size() || fields[column + 1].empty()) {
      report.skip(file.string(), fmt::format("line {}: found {}, expected a time in seconds and a file name",
                                             line.number, in_quotes(line.text)));
      continue;
    }
    images.push_back({*time, file.parent_path() / fields[column + 1]});
  }
  return images;
}

Result<SequenceListing> read_tum_layout(const fs::path& folder, const LayoutChoice& choice,
                                        ReadReport& report) {
  SequenceListing listing;
  listing.layout = "TUM RGB-D";
  if (choice.calibration_file.empty() && !path_exists(folder / "camera.yaml")) {
    return Error{fmt::format("{}: no such file, expected the calibration of the camera",
                             (folder / "camera.yaml").string())};
  }
  auto calibration = with_overrides({}, folder, choice, report);
  if (!calibration) return calibration.error();
  listing.calibration = std::move(*calibration);

  auto images = list_images(folder, "rgb", 0, report);
  if (!images) return images.error();
  listing.images = std::move(*images);
  if (path_exists(folder / "depth") || path_exists(folder / "depth.txt")) {
    auto depth = list_images(folder, "depth", 2, report);
    if (!depth) return depth.error();
    listing.depth = std::move(*depth);
  }

  if (choice.computed) return listing;
  listing.pose_file = pose_file(folder, choice.poses);
  auto trajectory = read_trajectory(listing.pose_file, report);
  if (!trajectory) return trajectory.error();
  listing.trajectory = std::move(*trajectory);
  listing.poses_of_body = listing.calibration.pose_convention == PoseConvention::body_to_world;
  if (listing.calibration.T_body_camera && !listing.calibration.pose_convention) {
    report.notes.emplace_back(
        "T_body_camera is given without pose_convention: the poses are taken as the camera's "
        "(camera_to_world_optical); write body_to_world where they are the body's");
  }
  return listing;
}

}  // namespace pade::io
