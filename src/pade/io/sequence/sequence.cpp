#include "pade/io/sequence/sequence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "pade/core/option_check.hpp"
#include "pade/io/sequence/depth_file.hpp"
#include "pade/io/sequence/frame_mask.hpp"
#include "pade/io/sequence/image_file.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/sequence/pose_world.hpp"
#include "pade/io/text.hpp"

namespace pade::io {

namespace fs = std::filesystem;

namespace {

struct FrameEntry {
  Time time;
  fs::path image;
  Pose T_world_camera;
  Matrix6d motion_covariance = Matrix6d::Zero();
  fs::path depth;  ///< empty = no truth
};

/// An image of the list whose file looks whole.
struct Candidate {
  StampedFile source;
  ImageInfo info;
};

std::string size_text(cv::Size size) { return fmt::format("{} x {}", size.width, size.height); }

/// Images in order of time with files that look whole; the others go to the report.
std::vector<Candidate> whole_images(std::vector<StampedFile> images, const ImageStore& store,
                                    const fs::path& folder, ReadReport& report) {
  const auto earlier = [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; };
  if (!std::is_sorted(images.begin(), images.end(), earlier)) {
    std::stable_sort(images.begin(), images.end(), earlier);
    report.notes.push_back(
        fmt::format("{}: the images were not listed in order of time and have been sorted", folder.string()));
  }
  std::vector<Candidate> whole;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (i > 0 && images[i].time == images[i - 1].time) {
      report.skip(images[i].file.string(), fmt::format("time {} was seen before", to_string(images[i].time)));
      continue;
    }
    const auto info = store.inspect(images[i].file);
    if (info) {
      whole.push_back({images[i], *info});
    } else {
      report.skip(images[i].file.string(), info.error().message);
    }
  }
  return whole;
}

/// The most frequent size and number of bits: what the sequence is, where the calibration does not say.
ImageInfo most_frequent(const std::vector<Candidate>& images) {
  std::map<std::tuple<int, int, int>, int> counts;
  ImageInfo best;
  int most = 0;
  for (const auto& [source, info] : images) {
    const int count = ++counts[{info.size.width, info.size.height, info.bits}];
    if (count > most) std::tie(most, best) = std::tuple(count, info);
  }
  return best;
}

/// Keeps the images of the right size and depth that have a pose.
std::vector<FrameEntry> usable_frames(const std::vector<Candidate>& images, SequenceListing& listing,
                                      const Camera& camera, int bits, double largest_gap,
                                      ReadReport& report) {
  const Calibration& calibration = listing.calibration;
  const Time offset = Time::from_seconds(listing.computed ? 0 : calibration.time_offset_s.value_or(0));
  std::vector<FrameEntry> frames;
  int missed = 0;  // since the last frame: the next motion is over all of them
  for (const auto& [source, info] : images) {
    const std::string file = source.file.string();
    if (info.size != camera.size() || info.bits != bits) {
      report.skip(file, info.bits != bits
                            ? fmt::format("the image has {} bits, expected {} as the others", info.bits, bits)
                            : fmt::format("the image has {} pixels, expected {} as the calibration states",
                                          size_text(info.size), size_text(camera.size())));
      ++missed;
      continue;
    }
    const auto pose = listing.trajectory.at({source.time.nanoseconds + offset.nanoseconds}, largest_gap);
    if (!pose) {
      report.skip(file, "no pose: " + pose.error().message);
      ++listing.frames_without_pose;
      continue;
    }
    FrameEntry frame{source.time, source.file, *pose, Matrix6d::Zero(), {}};
    if (listing.poses_of_body) frame.T_world_camera = camera_pose(*pose, *calibration.T_body_camera);
    if (const auto known = listing.covariances.find(source.time); known != listing.covariances.end())
      frame.motion_covariance = over_missed(known->second, missed);
    missed = 0;
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// Fills the listing's trajectory from a source of poses.
Status compute_poses(const PoseSource& source, const fs::path& folder, const std::vector<Candidate>& images,
                     SequenceListing& listing, ReadReport& report) {
  std::vector<Time> times;
  for (const Candidate& image : images) times.push_back(image.source.time);
  auto computed = source(folder, times, listing.calibration);
  if (!computed) return computed.error();
  for (std::size_t i = 0; i < computed->poses.size(); ++i) {
    listing.covariances[computed->poses[i].time] = computed->covariances[i];
  }
  listing.trajectory = Trajectory(std::move(computed->poses));
  listing.computed = true;
  listing.motions_without_scale = computed->motions_without_scale;
  listing.navigation = std::move(computed->navigation);
  report.notes.insert(report.notes.end(), computed->notes.begin(), computed->notes.end());
  return {};
}

/// Gives every frame the depth image nearest in time. Returns how far the nearest of all is from its frame,
/// s.
double associate_truth(std::vector<FrameEntry>& frames, std::vector<StampedFile> depth, double largest_gap) {
  double least = std::numeric_limits<double>::infinity();
  std::stable_sort(depth.begin(), depth.end(),
                   [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; });
  for (FrameEntry& frame : frames) {
    auto nearest = std::lower_bound(depth.begin(), depth.end(), frame.time,
                                    [](const StampedFile& d, Time t) { return d.time < t; });
    const auto distance = [&](auto it) { return std::abs(seconds_between(it->time, frame.time)); };
    if (nearest != depth.begin() && (nearest == depth.end() || distance(nearest - 1) <= distance(nearest))) {
      --nearest;
    }
    if (nearest == depth.end()) continue;
    least = std::min(least, distance(nearest));
    if (distance(nearest) <= largest_gap) frame.depth = nearest->file;
  }
  return least;
}

/// At most `most` of the frames, evenly spread, first and last included.
std::vector<fs::path> spread(const std::vector<FrameEntry>& frames, std::size_t most) {
  const std::size_t count = std::min(most, frames.size());
  std::vector<fs::path> files;
  for (std::size_t i = 0; i < count; ++i) {
    files.push_back(frames[count > 1 ? i * (frames.size() - 1) / (count - 1) : 0].image);
  }
  return files;
}

IntensityScaling choose_intensity(int bits, const std::vector<FrameEntry>& frames, const ImageStore& store,
                                  const Calibration& calibration) {
  if (bits == 8) return {};
  if (calibration.intensity) {
    return {bits, (*calibration.intensity)[0], (*calibration.intensity)[1],
            "intensity_range of the calibration"};
  }
  constexpr std::size_t kSamples = 8;
  std::vector<cv::Mat> samples;
  for (const fs::path& file : spread(frames, kSamples)) {
    auto image = store.read(file);
    if (image && image->depth() == CV_16U) samples.push_back(std::move(*image));
  }
  return intensity_from_percentiles(samples);
}

std::vector<Pose> poses_of(const std::vector<FrameEntry>& frames) {
  std::vector<Pose> poses;
  for (const FrameEntry& frame : frames) poses.push_back(frame.T_world_camera);
  return poses;
}

std::string first_reason(const ReadReport& report) {
  if (report.skipped.empty()) return {};
  const auto& [file, reason] = report.skipped[0];
  return reason.starts_with(file + ": ") ? fmt::format("; first: {}", reason)
                                         : fmt::format("; first: {}: {}", file, reason);
}

/// The rule of docs/sequences.md for frames that cannot be used.
Status enough_usable(std::size_t usable, std::size_t listed, const ReadReport& report,
                     const fs::path& folder) {
  if (usable < 2) {
    return Error{fmt::format("{}: {} of {} frames usable, expected at least 2{}", folder.string(), usable,
                             listed, first_reason(report))};
  }
  if (2 * (listed - usable) > listed) {
    return Error{fmt::format("{}: {} of {} frames unusable, expected at most half{}", folder.string(),
                             listed - usable, listed, first_reason(report))};
  }
  return {};
}

/// Names inside the sequence are given relative to it.
void make_relative(ReadReport& report, const fs::path& folder) {
  for (Skipped& entry : report.skipped)
    entry = skipped_in(folder, std::move(entry.file), std::move(entry.reason));
}

}  // namespace

Status check(const SequenceOptions& options) {
  if (!options.world_up.empty() && !parse_direction(options.world_up)) {
    return Error{fmt::format("option world_up is {}, expected +x, -x, +y, -y, +z, -z or three numbers",
                             in_quotes(options.world_up))};
  }
  const bool named = options.origin == "auto" || options.origin == "flight" || options.origin == "none";
  if (!named && !parse_point(options.origin)) {
    return Error{fmt::format("option origin is {}, expected auto, flight, none or three numbers in metres",
                             in_quotes(options.origin))};
  }
  if (options.camera < 0) return Error{"option camera: expected a number >= 0"};
  const OptionRange ranges[] = {
      {"largest_pose_gap", options.largest_pose_gap},
      {"largest_truth_gap", options.largest_truth_gap},
      {"mask_growth", static_cast<double>(options.mask_growth), 0, 65536},
  };
  return check_ranges(ranges);
}

struct Sequence::Data {
  fs::path folder;
  SequenceOptions options;
  SequenceListing listing;
  ReadReport report;
  Camera raw_camera;
  Camera camera;
  Undistorter undistorter{Camera{}};
  std::vector<FrameEntry> frames;
  IntensityScaling intensity;
  cv::Mat mask;
  std::optional<WorldUp> up;
  std::optional<GeographicOrigin> origin;
  Eigen::Vector3d local_origin = Eigen::Vector3d::Zero();

  Status choose_frames(const PoseSource& source);
  Status make_mask();
  void choose_truth();
  void choose_world();
  void choose_origin();
};

/// Camera and frames.
Status Sequence::Data::choose_frames(const PoseSource& source) {
  if (listing.images.empty()) {
    return Error{fmt::format(
        "{}: no images found in the layout {}, expected PNG, JPEG, PGM, PPM, PNM, BMP, TIFF or WebP "
        "(docs/sequences.md){}",
        folder.string(), listing.layout, first_reason(report))};
  }
  const Calibration& calibration = listing.calibration;
  if (!calibration.camera) {
    return Error{
        fmt::format("{}: the calibration states no camera, expected width, height, fx, fy, cx, cy and "
                    "distortion_model in camera.yaml",
                    folder.string())};
  }
  if (listing.poses_of_body && !calibration.T_body_camera) {
    return Error{
        fmt::format("{}: field T_body_camera is missing, expected it because the poses are of the body",
                    folder.string())};
  }
  raw_camera = *calibration.camera;
  const std::vector<Candidate> images = whole_images(listing.images, *listing.store, folder, report);
  const ImageInfo kind = most_frequent(images);
  if (raw_camera.width == 0 || raw_camera.height == 0) {
    raw_camera.width = kind.size.width;
    raw_camera.height = kind.size.height;
  }
  if (kind.bits != 8 && kind.bits != 16) {
    return Error{fmt::format("{}: the images have {} bits, expected 8 or 16", folder.string(), kind.bits)};
  }
  if (source) {
    if (Status status = compute_poses(source, folder, images, listing, report); !status) return status;
  }
  frames = usable_frames(images, listing, raw_camera, kind.bits, options.largest_pose_gap, report);
  if (auto enough = enough_usable(frames.size(), listing.images.size(), report, folder); !enough)
    return enough;
  intensity = choose_intensity(kind.bits, frames, *listing.store, calibration);
  camera = raw_camera.undistorted();
  undistorter = Undistorter(raw_camera);
  return {};
}

Status Sequence::Data::make_mask() {
  const fs::path file = folder / "mask.png";
  if (!listing.mask.empty() && listing.mask.size() == raw_camera.size()) {
    mask = listing.mask;
  } else if (path_exists(file)) {
    const auto recorded = read_mask(file, raw_camera.size());
    if (!recorded) return recorded.error();
    mask = undistorted_mask(*recorded, false, raw_camera, undistorter, options.mask_growth);
  } else {
    constexpr std::size_t kSamples = 128;  // all frames of a short sequence
    const cv::Mat black = black_in_every_image(spread(frames, kSamples), *listing.store, raw_camera.size());
    mask = undistorted_mask(cv::Mat(~black), true, raw_camera, undistorter, options.mask_growth);
  }
  if (cv::countNonZero(mask) == 0) {
    return Error{
        fmt::format("{}: no pixel is valid in mask, lens and images, expected some", folder.string())};
  }
  return {};
}

void Sequence::Data::choose_truth() {
  if (listing.depth.empty()) {
    if (const std::size_t files = files_in(listing.depth_folder); files > 0) {
      report.skip(listing.depth_folder.string(),
                  fmt::format("found {} files in it and no depth image, expected true depth as in "
                              "docs/sequences.md, or nothing",
                              files));
    }
    return;
  }
  if (!listing.calibration.depth_scale) {
    report.skip((folder / "depth").string(),
                "field depth_scale is missing in the calibration, expected it to read true depth");
    return;
  }
  const double nearest = associate_truth(frames, listing.depth, options.largest_truth_gap);
  if (std::all_of(frames.begin(), frames.end(), [](const FrameEntry& f) { return f.depth.empty(); })) {
    report.skip(listing.depth_folder.string(),
                fmt::format("found {} depth images, none within {:g} s of a frame (the nearest is {:.3g} s "
                            "off), expected the times of the frames",
                            listing.depth.size(), options.largest_truth_gap, nearest));
  }
}

void Sequence::Data::choose_world() {
  if (!options.world_up.empty()) {
    up = WorldUp{*parse_direction(options.world_up), true, "command line"};
  } else if (listing.computed) {
    up = WorldUp{Eigen::Vector3d::UnitZ(), true, "east-north-up of the GNSS"};
  } else if (listing.calibration.world_up) {
    up = WorldUp{*listing.calibration.world_up, true, "camera.yaml"};
  } else if (listing.world_up) {
    up = listing.world_up;
  }
  origin = listing.calibration.origin ? listing.calibration.origin : gnss_origin(folder);
  if (up) return;
  const std::vector<Pose> cameras = poses_of(frames);
  up = guess_up(cameras);
  if (!up && origin && may_point_up(Eigen::Vector3d::UnitZ(), cameras)) {
    up = WorldUp{Eigen::Vector3d::UnitZ(), false, "east-north-up of the geographic origin"};
  }
  if (up) return;
  report.notes.push_back(
      fmt::format("which axis points up is unknown ({}); say it with --world-up or world_up in "
                  "camera.yaml",
                  why_no_up(cameras)));
}

void Sequence::Data::choose_origin() {
  local_origin = chosen_origin(options.origin, poses_of(frames));
  if (local_origin.isZero(0)) return;
  for (FrameEntry& frame : frames) frame.T_world_camera.translation -= local_origin;
  report.notes.push_back(
      fmt::format("the positions lie far from 0 0 0: the run is made around the local origin {} {} {}, which "
                  "is in run.json",
                  local_origin.x(), local_origin.y(), local_origin.z()));
}

Result<Sequence> Sequence::open(const fs::path& folder, const SequenceOptions& options,
                                const PoseSource& source) {
  if (auto good = io::check(options); !good) return good.error();
  auto data = std::make_unique<Data>();
  data->folder = folder;
  data->options = options;
  auto listing = read_layout(
      folder, {options.poses, options.calibration, source != nullptr, options.camera, options.topics},
      data->report);
  if (!listing) return listing.error();
  if (source) listing->pose_file = options.poses;
  data->listing = std::move(*listing);
  if (auto good = data->choose_frames(source); !good) return good.error();
  if (auto good = data->make_mask(); !good) return good.error();
  data->choose_truth();
  data->choose_world();
  data->choose_origin();
  make_relative(data->report, folder);
  Sequence sequence(std::move(data));
  if (auto good = sequence.check(0); !good) return good.error();
  return sequence;
}

Status Sequence::check(std::size_t undecodable) const {
  const std::size_t usable = size() - std::min(undecodable, size());
  if (auto enough = enough_usable(usable, listed_frames(), data_->report, folder()); !enough) return enough;
  if (options().strict && !skipped().empty()) {
    return Error{fmt::format("{}: {} (and {} more skipped), refused because of strict",
                             (folder() / skipped()[0].file).string(), skipped()[0].reason,
                             skipped().size() - 1)};
  }
  if (options().strict && undecodable > 0) {
    return Error{fmt::format("{}: {} frames cannot be decoded, refused because of strict", folder().string(),
                             undecodable)};
  }
  return {};
}

Result<Frame> Sequence::frame(std::size_t i) const {
  const FrameEntry& entry = data_->frames[i];
  const auto image = data_->listing.store->read(entry.image);
  if (!image) return image.error();
  const int depth = data_->intensity.bits == 16 ? CV_16U : CV_8U;
  if (image->size() != data_->raw_camera.size() || image->depth() != depth) {
    return Error{fmt::format("{}: the image has {} pixels of {} bits, expected {} of {}",
                             entry.image.string(), size_text(image->size()), 8 * image->elemSize1(),
                             size_text(data_->raw_camera.size()), data_->intensity.bits)};
  }
  return Frame{entry.time, data_->undistorter(data_->intensity(*image)), entry.T_world_camera,
               entry.motion_covariance};
}

Result<EncodedImage> Sequence::encoded_image(std::size_t i) const {
  return data_->listing.store->encoded(data_->frames[i].image);
}

bool Sequence::has_truth() const {
  return std::any_of(data_->frames.begin(), data_->frames.end(),
                     [](const FrameEntry& f) { return !f.depth.empty(); });
}

Result<cv::Mat> Sequence::truth(std::size_t i) const {
  const FrameEntry& entry = data_->frames[i];
  if (entry.depth.empty()) {
    return Error{
        fmt::format("{}: no depth image within {:g} s", entry.image.string(), options().largest_truth_gap)};
  }
  const auto raw = read_depth_file(entry.depth);
  if (!raw) return raw.error();
  if (raw->size() != data_->raw_camera.size()) {
    return Error{fmt::format("{}: the depth image has {} pixels, expected {}", entry.depth.string(),
                             size_text(raw->size()), size_text(data_->raw_camera.size()))};
  }
  cv::Mat depth;
  raw->convertTo(depth, CV_32F);
  depth = depth / *data_->listing.calibration.depth_scale;
  depth.setTo(std::numeric_limits<float>::quiet_NaN(),
              ~((depth > 0) & (depth < std::numeric_limits<float>::infinity())));
  return data_->undistorter.depth(depth);
}

Sequence::Sequence(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Sequence::Sequence(Sequence&&) noexcept = default;
Sequence& Sequence::operator=(Sequence&&) noexcept = default;
Sequence::~Sequence() = default;

std::size_t Sequence::size() const { return data_->frames.size(); }
Time Sequence::time(std::size_t i) const { return data_->frames[i].time; }
const fs::path& Sequence::image_file(std::size_t i) const { return data_->frames[i].image; }
const fs::path& Sequence::depth_file(std::size_t i) const { return data_->frames[i].depth; }
const Pose& Sequence::pose(std::size_t i) const { return data_->frames[i].T_world_camera; }
const Camera& Sequence::camera() const { return data_->camera; }
const Camera& Sequence::raw_camera() const { return data_->raw_camera; }
const cv::Mat& Sequence::mask() const { return data_->mask; }
const fs::path& Sequence::folder() const { return data_->folder; }
const std::string& Sequence::layout() const { return data_->listing.layout; }
const fs::path& Sequence::pose_file() const { return data_->listing.pose_file; }
const SequenceOptions& Sequence::options() const { return data_->options; }
const IntensityScaling& Sequence::intensity() const { return data_->intensity; }
const std::optional<WorldUp>& Sequence::world_up() const { return data_->up; }
const std::optional<GeographicOrigin>& Sequence::origin() const { return data_->origin; }
const Eigen::Vector3d& Sequence::local_origin() const { return data_->local_origin; }
const Calibration& Sequence::calibration() const { return data_->listing.calibration; }
const Trajectory& Sequence::trajectory() const { return data_->listing.trajectory; }
bool Sequence::poses_of_body() const { return data_->listing.poses_of_body; }
bool Sequence::poses_computed() const { return data_->listing.computed; }
bool Sequence::mask_is_stated() const {
  return !data_->listing.mask.empty() || path_exists(data_->folder / "mask.png");
}
const Matrix6d& Sequence::motion_covariance(std::size_t i) const {
  return data_->frames[i].motion_covariance;
}
const std::optional<Pose>& Sequence::T_imu_camera() const { return data_->listing.T_imu_camera; }
const std::vector<std::string>& Sequence::sources() const { return data_->listing.sources; }
std::size_t Sequence::listed_frames() const { return data_->listing.images.size(); }
std::size_t Sequence::frames_without_pose() const { return data_->listing.frames_without_pose; }
std::size_t Sequence::motions_without_scale() const { return data_->listing.motions_without_scale; }
const std::optional<NavigationHealth>& Sequence::navigation() const { return data_->listing.navigation; }
const std::vector<Skipped>& Sequence::skipped() const { return data_->report.skipped; }
const std::vector<std::string>& Sequence::notes() const { return data_->report.notes; }

}  // namespace pade::io
