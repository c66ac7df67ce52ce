// The layout of TartanAir: image_left/, depth_left/ and pose_left.txt (image_lcam_front/ and so on in its
// second version). Row i of the poses belongs to image i; they are those of a camera with forward, right,
// down axes in a north-east-down world, and no file says times or a lens.
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStep = 100'000'000;  // ns between frames, which the data set does not state

/// A camera of the data set by its names.
struct Side {
  const char* name;
  int height;  ///< of the images; the first version's are 4:3
};
constexpr Side kSides[] = {
    {"left", 480},      {"right", 480},      {"lcam_front", 640}, {"rcam_front", 640},  {"lcam_back", 640},
    {"lcam_left", 640}, {"lcam_right", 640}, {"lcam_top", 640},   {"lcam_bottom", 640}, {"rcam_back", 640},
    {"rcam_left", 640}, {"rcam_right", 640}, {"rcam_top", 640},   {"rcam_bottom", 640}};

fs::path images_of(const fs::path& folder, const Side& side) {
  return folder / fmt::format("image_{}", side.name);
}
fs::path poses_of(const fs::path& folder, const Side& side) {
  return folder / fmt::format("pose_{}.txt", side.name);
}

const Side* side_of(const fs::path& folder) {
  for (const Side& side : kSides) {
    if (path_exists(images_of(folder, side)) && path_exists(poses_of(folder, side))) return &side;
  }
  return nullptr;
}

/// "000012_left.png" is image 12.
std::optional<std::int64_t> number_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  std::int64_t number = 0;
  const auto [stop, status] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  constexpr std::int64_t kMost = 1'000'000'000;
  if (status != std::errc{} || number < 0 || number > kMost) return std::nullopt;
  return number;
}

std::vector<StampedFile> numbered(const std::vector<fs::path>& files, ReadReport& report) {
  std::vector<StampedFile> out;
  for (const fs::path& file : files) {
    if (const auto number = number_of(file)) {
      out.push_back({Time{*number * kStep}, file});
    } else {
      report.skip(file.string(),
                  fmt::format("found name {}, expected it to begin with the number of a pose row",
                              in_quotes(file.stem().string())));
    }
  }
  return out;
}

/// The depth images; the first version's are arrays.
std::vector<fs::path> depth_files(const fs::path& folder) {
  std::vector<fs::path> files = image_files(folder);
  if (!files.empty()) return files;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    if (entry->path().extension() == ".npy") files.push_back(entry->path());
  }
  return files;
}

Calibration calibration_of(const Side& side) {
  Calibration calibration;
  calibration.format = "TartanAir";
  calibration.camera = Camera{640, side.height, 320, 320, 320, side.height / 2.0, Distortion::none,
                              {}};  // as published, for all
  Eigen::Matrix3d R_body_camera;    // the body is forward, right, down
  R_body_camera << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  calibration.T_body_camera = Pose{Eigen::Quaterniond(R_body_camera), Eigen::Vector3d::Zero()};
  calibration.depth_scale = 1;
  return calibration;
}

Result<Trajectory> read_rows(const fs::path& file, ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  std::vector<Time> times;
  for (std::size_t i = 0; i < data_lines(*text).size(); ++i)
    times.push_back({static_cast<std::int64_t>(i) * kStep});
  return parse_any_poses(*text, file.string(), times, report);
}

}  // namespace

bool is_tartanair_layout(const fs::path& folder) {
  return side_of(folder) != nullptr && !path_exists(folder / "groundtruth.txt");
}

Result<SequenceListing> read_tartanair_layout(const fs::path& folder, const LayoutChoice& choice,
                                              ReadReport& report) {
  const Side& side = *side_of(folder);
  SequenceListing listing;
  listing.layout = "TartanAir";
  auto calibration = with_overrides(calibration_of(side), folder, choice, report);
  if (!calibration) return calibration.error();
  listing.calibration = std::move(*calibration);
  listing.images = numbered(image_files(images_of(folder, side)), report);
  listing.depth_folder = folder / fmt::format("depth_{}", side.name);
  listing.depth = numbered(depth_files(listing.depth_folder), report);
  report.notes.emplace_back("the layout states no times: the frames are taken as 0.1 s apart");
  if (choice.computed) return listing;
  if (choice.poses == "original") {
    return Error{
        fmt::format("{}: the TartanAir layout has no original poses, expected groundtruth or a pose file",
                    folder.string())};
  }
  listing.pose_file = choice.poses == "groundtruth" ? poses_of(folder, side) : fs::path(choice.poses);
  auto trajectory = read_rows(listing.pose_file, report);
  if (!trajectory) {
    const bool own = choice.poses == "groundtruth";
    return own ? Error{fmt::format("{} (of TartanAir: `tx ty tz qx qy qz qw`, row i for image i)",
                                   trajectory.error().message)}
               : trajectory.error();
  }
  listing.trajectory = std::move(*trajectory);
  listing.poses_of_body = listing.calibration.pose_convention != PoseConvention::camera_to_world_optical;
  listing.world_up = WorldUp{-Eigen::Vector3d::UnitZ(), true, "TartanAir layout"};  // north, east, down
  return listing;
}

}  // namespace pade::io
