// The TUM RGB-D layout: rgb/, depth/, rgb.txt, depth.txt or associations.txt, groundtruth.txt, camera.yaml.
#include <algorithm>
#include <cctype>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/image_file.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/stamps.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

using Fields = std::vector<std::string_view>;

/// The file name in a field, which may hold blanks: quoted, or the rest of the line where that is a file.
std::string file_name_at(std::string_view line, const Fields& fields, std::size_t i, const fs::path& folder) {
  const std::string_view field = fields[i];
  std::string_view rest = line.substr(static_cast<std::size_t>(field.data() - line.data()));
  if (rest.front() == '"' || rest.front() == '\'') {
    const std::size_t end = rest.find(rest.front(), 1);
    if (end != std::string_view::npos) return std::string(rest.substr(1, end - 1));
  }
  if (i + 1 < fields.size() && !path_exists(folder / field) && path_exists(folder / rest))
    return std::string(rest);
  return std::string(field);
}

Result<std::vector<StampedFile>> read_image_list(const fs::path& file, std::size_t column,
                                                 ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_image_list(*text, file, column, report);
}

/// Image files whose names are their times, in order of time: as text 10.1 would come before 2.9.
std::vector<StampedFile> files_named_by_time(const fs::path& folder, ReadReport& report) {
  std::vector<std::string> stems;
  std::vector<fs::path> images = image_files(folder);
  for (const fs::path& file : images) stems.push_back(file.stem().string());
  const TimeUnit unit = unit_of_frames(std::vector<std::string_view>(stems.begin(), stems.end()));
  if (unit != TimeUnit::seconds) {
    report.notes.push_back(
        fmt::format("{}: the names look like {} and are read so", folder.string(), name_of(unit)));
  }
  std::vector<StampedFile> files;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (const auto time = parse_stamp(stems[i], unit)) {
      files.push_back({*time, images[i]});
    } else {
      report.skip(
          images[i].string(),
          fmt::format(
              "found name {}, expected the time in seconds, or beside the folder a list {}.txt of rows 'time "
              "file'",
              in_quotes(stems[i]), folder.filename().string()));
    }
  }
  std::stable_sort(files.begin(), files.end(),
                   [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; });
  return files;
}

bool is_depth_name(std::string_view name) { return name.find("depth") != std::string_view::npos; }

/// Whether associations.txt lists the depth image first, as ICL-NUIM does: by the names, else by the files.
bool depth_comes_first(std::string_view text, const fs::path& folder) {
  std::size_t first = 0;
  std::size_t second = 0;
  std::optional<Fields> row;
  for (const Line& line : data_lines(text)) {
    const Fields fields = split_fields(line.text);
    if (fields.size() < 4) continue;
    if (!row) row = fields;
    first += is_depth_name(fields[1]) ? 1 : 0;
    second += is_depth_name(fields[3]) ? 1 : 0;
  }
  if (first != second || !row) return first > second;
  const auto bits = [&](std::string_view name) {
    const auto info = inspect_image(folder / name);
    return info ? info->bits : 0;
  };
  return bits((*row)[1]) == 16 && bits((*row)[3]) == 8;
}

/// The folder or list of the camera images: rgb, or what other programs call it.
std::string name_of_images(const fs::path& folder) {
  for (const char* name : {"rgb", "images", "image", "color", "colour", "image_left"}) {
    if (path_exists(folder / fmt::format("{}.txt", name)) || path_exists(folder / name)) return name;
  }
  return "rgb";
}

Result<std::vector<StampedFile>> list_images(const fs::path& folder, const std::string& kind, bool depth,
                                             ReadReport& report) {
  const std::string list = fmt::format("{}.txt", kind);
  if (path_exists(folder / list)) return read_image_list(folder / list, 0, report);
  const fs::path associations = folder / "associations.txt";
  if (path_exists(associations)) {
    const auto text = read_file(associations);
    if (!text) return text.error();
    const bool swapped = depth_comes_first(*text, folder);
    if (swapped && !depth) {
      report.notes.push_back(fmt::format("{}: the depth images come first", associations.string()));
    }
    return parse_image_list(*text, associations, depth != swapped ? 2 : 0, report);
  }
  return files_named_by_time(folder / kind, report);
}

std::vector<Time> times_of(const std::vector<StampedFile>& images) {
  std::vector<StampedFile> by_name = images;
  std::sort(by_name.begin(), by_name.end(),
            [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; });
  std::vector<Time> times;
  for (const StampedFile& image : by_name) times.push_back(image.time);
  return times;
}

fs::path pose_file(const fs::path& folder, const std::string& poses) {
  if (poses == "groundtruth") return folder / "groundtruth.txt";
  if (poses == "original") return folder / "groundtruth_original.txt";
  return poses;
}

}  // namespace

std::vector<StampedFile> parse_image_list(std::string_view text, const fs::path& file, std::size_t column,
                                          ReadReport& report) {
  const std::vector<Line> lines = data_lines(text);
  std::vector<std::string_view> stamps;
  for (const Line& line : lines) {
    const Fields fields = split_fields(line.text);
    if (column < fields.size()) stamps.push_back(fields[column]);
  }
  const TimeUnit unit = unit_of_frames(stamps);
  if (unit != TimeUnit::seconds) {
    report.notes.push_back(
        fmt::format("{}: the stamps look like {} and are read so", file.string(), name_of(unit)));
  }
  std::vector<StampedFile> images;
  for (const Line& line : lines) {
    const Fields fields = split_fields(line.text);
    const auto time = column < fields.size() ? parse_stamp(fields[column], unit) : std::nullopt;
    if (!time || column + 1 >= fields.size() || fields[column + 1].empty()) {
      report.skip(file.string(), fmt::format("line {}: found {}, expected a time in seconds and a file name",
                                             line.number, in_quotes(line.text)));
      continue;
    }
    images.push_back(
        {*time, file.parent_path() / file_name_at(line.text, fields, column + 1, file.parent_path())});
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

  const std::string name = name_of_images(folder);
  auto images = list_images(folder, name, false, report);
  if (!images) return images.error();
  if (images->empty() && report.skipped.empty()) {
    return Error{fmt::format(
        "{}: no images found, expected PNG, JPEG, PGM, PPM, PNM, BMP, TIFF or WebP named by their time in "
        "seconds, or listed in {}.txt",
        (folder / name).string(), name)};
  }
  listing.images = std::move(*images);
  listing.depth_folder = folder / "depth";
  const bool listed = path_exists(folder / "associations.txt");
  if (path_exists(folder / "depth") || path_exists(folder / "depth.txt") || listed) {
    auto depth = list_images(folder, "depth", true, report);
    if (!depth) return depth.error();
    listing.depth = std::move(*depth);
  }

  if (choice.computed) return listing;
  listing.pose_file = pose_file(folder, choice.poses);
  if (choice.poses == "groundtruth" && !path_exists(listing.pose_file))
    return Error{fmt::format("{}: no such file, {}", listing.pose_file.string(), kWherePosesComeFrom)};
  auto trajectory = read_any_poses(listing.pose_file, times_of(listing.images), report);
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
