#include "pade/io/sequence/layouts/sequence_layout.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>

#include <fmt/format.h>

#include "pade/io/foreign_file.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

template <class T>
void replace(std::optional<T>& value, const std::optional<T>& other) {
  if (other) value = other;
}

/// What `other` states instead of what `base` states.
void override_with(Calibration& base, const Calibration& other) {
  if (other.camera) base.format = other.format;
  replace(base.camera, other.camera);
  replace(base.T_body_camera, other.T_body_camera);
  replace(base.time_offset_s, other.time_offset_s);
  replace(base.pose_convention, other.pose_convention);
  replace(base.depth_scale, other.depth_scale);
  replace(base.intensity, other.intensity);
  replace(base.world_up, other.world_up);
  replace(base.gnss_lever_arm, other.gnss_lever_arm);
  replace(base.origin, other.origin);
}

using LayoutReader = Result<SequenceListing> (*)(const fs::path&, const LayoutChoice&, ReadReport&);

/// Of the layout that a folder has; none if it has none that is known.
LayoutReader reader_of(const fs::path& folder) {
  if (path_exists(folder / "mav0" / "cam0") || path_exists(folder / "cam0" / "data.csv"))
    return read_euroc_layout;
  if (is_tartanair_layout(folder)) return read_tartanair_layout;
  if (is_icl_nuim_layout(folder)) return read_icl_nuim_layout;
  for (const char* name : {"image_0", "image_1", "image_2", "image_3"})
    if (path_exists(folder / name)) return read_kitti_layout;
  for (const char* name : {"rgb", "rgb.txt", "associations.txt", "images", "images.txt", "image", "color",
                           "colour", "image_left"}) {
    if (path_exists(folder / name)) return read_tum_layout;
  }
  return nullptr;
}

}  // namespace

bool looks_like_a_sequence(const fs::path& folder) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure)) return false;
  return is_recording(folder) || reader_of(folder) != nullptr ||
         (path_exists(folder / "camera.yaml") && path_exists(folder / "groundtruth.txt"));
}

std::vector<fs::path> image_files(const fs::path& folder) {
  static constexpr std::array<std::string_view, 10> kExtensions = {".png", ".jpg", ".jpeg", ".pgm",  ".ppm",
                                                                   ".pnm", ".bmp", ".tif",  ".tiff", ".webp"};
  std::vector<fs::path> files;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    std::string extension = entry->path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end()) {
      files.push_back(entry->path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::size_t files_in(const fs::path& folder) {
  std::size_t count = 0;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end; entry.increment(failure))
    count += entry->path().filename().string().starts_with(".") ? 0 : 1;
  return count;
}

Result<Calibration> with_overrides(Calibration base, const fs::path& folder, const LayoutChoice& choice,
                                   ReadReport& report) {
  for (const std::string& field : base.unknown_fields) {
    report.notes.push_back(fmt::format("the calibration field {} is unknown and was ignored", field));
  }
  std::vector<fs::path> files;
  if (path_exists(folder / "camera.yaml")) files.push_back(folder / "camera.yaml");
  if (!choice.calibration_file.empty()) files.push_back(choice.calibration_file);
  if (files.empty() && choice.camera > 0) {
    return Error{fmt::format(
        "{}: found no calibration file that holds several cameras in it, expected one since camera {} is "
        "asked for (--camera, --calibration)",
        folder.string(), choice.camera)};
  }
  for (const fs::path& file : files) {
    const bool asked_for = !choice.calibration_file.empty() && file == files.back();
    // The number is that of a camera in the file that has the last word.
    const auto read = read_calibration(file, file == files.back() ? choice.camera : 0);
    if (!read) return read.error();
    if (asked_for && !read->camera && !(choice.mounting_alone && read->T_body_camera)) {
      return Error{
          fmt::format("{}: found no camera in it, expected the calibration that was asked for (known "
                      "dialects: docs/formats.md)",
                      file.string())};
    }
    override_with(base, *read);
    for (const std::string& field : read->unknown_fields) {
      report.notes.push_back(fmt::format("{}: field {} is unknown and was ignored", file.string(), field));
    }
  }
  return base;
}

Result<SequenceListing> read_layout(const fs::path& folder, const LayoutChoice& choice, ReadReport& report) {
  if (!path_exists(folder)) return Error{fmt::format("{}: no such folder", folder.string())};
  if (is_recording(folder)) return read_recording_layout(folder, choice, report);
  std::error_code failure;
  if (!choice.topics.empty()) {
    return Error{fmt::format("{}: is no recording of ROS, expected one since topics are named ({})",
                             folder.string(), in_quotes(choice.topics))};
  }
  if (!fs::is_directory(folder, failure)) {
    return Error{fmt::format("{}: is a file, expected the folder of a sequence or a recording of ROS{}",
                             folder.string(), advice_for(folder))};
  }
  if (const LayoutReader read = reader_of(folder)) return read(folder, choice, report);
  if (const auto why = why_no_recording(folder)) return Error{folder.string() + ": " + *why};
  return Error{fmt::format(
      "{}: no known layout, expected rgb/ or images/ (TUM RGB-D, ICL-NUIM), mav0/cam0/ (EuRoC), image_0/ or "
      "image_2/ (KITTI odometry), or image_left/ with pose_left.txt (TartanAir)",
      folder.string())};
}

}  // namespace pade::io
