#include "pade/io/run/run_reader.hpp"

#include <algorithm>
#include <limits>
#include <system_error>

#include <fmt/format.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/run/run_images.hpp"
#include "pade/io/run/run_writer.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace fs = std::filesystem;
namespace {

Result<std::vector<Time>> times_of_stack(const fs::path& folder) {
  std::vector<Time> times;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    if (entry->path().extension() != ".png") continue;
    const std::optional<Time> time = parse_time(entry->path().stem().string());
    if (!time) {
      return Error{fmt::format("{}: found the name '{}', expected <seconds>.png", folder.string(),
                               entry->path().filename().string())};
    }
    times.push_back(*time);
  }
  std::sort(times.begin(), times.end());
  return times;
}

Result<cv::Mat> read_png(const Run& run, std::string_view stack, Time time, int type) {
  const fs::path path = run.folder / stack / (to_string(time) + ".png");
  const Result<std::string> bytes = read_file(path);
  if (!bytes) return bytes.error();
  cv::Mat image;
  if (auto decoded = decode_image(image_bytes(*bytes), Pixels::stored)) image = std::move(*decoded);
  if (image.type() != type || image.size() != run.info.camera.size() || image.empty()) {
    return Error{
        fmt::format("{}: found {}, expected a PNG of {} x {} pixels of {} bits", path.string(),
                    image.empty() ? "no image" : fmt::format("{} x {} pixels", image.cols, image.rows),
                    run.info.camera.width, run.info.camera.height, type == CV_16UC1 ? 16 : 8)};
  }
  return image;
}

bool has_stack(const RunInfo& info, std::string_view name) {
  return std::find(info.stacks.begin(), info.stacks.end(), name) != info.stacks.end();
}

}  // namespace

Result<Run> read_run(const fs::path& folder) {
  Run run;
  run.folder = folder;
  std::error_code code;
  if (!fs::is_directory(folder, code))
    return Error{fmt::format("{}: found no such folder, expected a run", folder.string())};
  const fs::path info_file = folder / RunWriter::run_file;
  if (!fs::exists(info_file, code)) {
    return Error{
        fmt::format("{}: found no run.json, expected the folder of a run of `pade map`", folder.string())};
  }
  const Result<std::string> info_text = read_file(info_file);
  if (!info_text) return info_text.error();
  Result<RunInfo> info = run_info_from_json(*info_text, info_file.string());
  if (!info) return info.error();
  run.info = std::move(info).value();

  const fs::path timing_file = folder / "timing.json";
  if (fs::exists(timing_file, code)) {
    const Result<std::string> timing_text = read_file(timing_file);
    if (!timing_text) return timing_text.error();
    Result<RunTiming> timing = run_timing_from_json(*timing_text, timing_file.string());
    if (!timing) return timing.error();
    run.timing = std::move(timing).value();
  }
  if (has_stack(run.info, "depth")) {
    Result<std::vector<Time>> times = times_of_stack(folder / "depth");
    if (!times) return times.error();
    run.depth_times = std::move(times).value();
  }
  return run;
}

Result<DepthImage> read_depth_image(const Run& run, Time time) {
  const Result<cv::Mat> counts = read_png(run, "depth", time, CV_16UC1);
  if (!counts) return counts.error();
  DepthImage image;
  image.time = time;
  image.depth = metres_of(*counts, run.info.depth_scale);
  image.variance = cv::Mat(counts->size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  if (has_stack(run.info, "sigma")) {
    const Result<cv::Mat> sigma = read_png(run, "sigma", time, CV_16UC1);
    if (!sigma) return sigma.error();
    const cv::Mat metres = metres_of(*sigma, run.info.sigma_scale);
    image.variance = metres.mul(metres);
  }
  if (has_stack(run.info, "state")) {
    const Result<cv::Mat> state = read_png(run, "state", time, CV_8UC1);
    if (!state) return state.error();
    image.state = *state;
  } else {
    image.state = cv::Mat(counts->size(), CV_8UC1, cv::Scalar(static_cast<int>(DepthState::measured)));
    image.state.setTo(static_cast<int>(DepthState::out_of_view), *counts == 0);
  }
  if (has_stack(run.info, "bound")) {
    const Result<cv::Mat> bound = read_png(run, "bound", time, CV_16UC1);
    if (!bound) return bound.error();
    image.bound = metres_of(*bound, run.info.bound_scale);
  }
  return image;
}

}  // namespace pade::io
