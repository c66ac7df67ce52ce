// What a folder layout (TUM RGB-D, EuRoC, KITTI odometry) delivers to Sequence: lists, not yet pixels.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/calibration.hpp"
#include "pade/io/skipped.hpp"
#include "pade/io/trajectory.hpp"

namespace pade::io {

struct StampedFile {
  Time time;
  std::filesystem::path file;
};

/// The lists of a sequence as found, in the order of the files.
struct SequenceListing {
  std::string layout;  ///< "TUM RGB-D", "EuRoC" or "KITTI odometry"
  std::vector<StampedFile> images;
  std::vector<StampedFile> depth;  ///< truth, may be empty
  std::filesystem::path pose_file;
  Trajectory trajectory;       ///< T_world_camera or T_world_body
  bool poses_of_body = false;  ///< T_body_camera of `calibration` is to be applied
  Calibration calibration;
  std::optional<WorldUp> world_up;  ///< where the layout itself prescribes it
};

/// What a layout needs to know of the options.
struct LayoutChoice {
  std::string poses;                       ///< groundtruth, original or a file
  std::filesystem::path calibration_file;  ///< empty = the layout's own
};

Result<SequenceListing> read_tum_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                        ReadReport& report);
Result<SequenceListing> read_euroc_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                          ReadReport& report);
Result<SequenceListing> read_kitti_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                          ReadReport& report);

/// Recognises the layout and reads it.
Result<SequenceListing> read_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                    ReadReport& report);

/// Image files directly inside `folder`, sorted by name; empty where there is no such folder.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// The layout's own calibration with what the options and an optional camera.yaml in `folder` say instead.
/// `own` is the layout's calibration file, or empty where it has none in this form.
Result<Calibration> layout_calibration(const std::filesystem::path& folder, const std::filesystem::path& own,
                                       const LayoutChoice& choice, ReadReport& report);

}  // namespace pade::io
