#include "diagnoses.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include <fmt/format.h>

namespace pade_ros {

std::string kind_of(const std::string& reason) {
  std::string kind = reason.substr(0, reason.find_first_of("0123456789"));
  while (!kind.empty() && (kind.back() == ' ' || kind.back() == '-')) kind.pop_back();
  return kind.empty() ? reason : kind;
}

double Recent::quantile(double share) const {
  if (values_.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted(values_.begin(), values_.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
}

Diagnosis diagnose_camera(const Counts& counts, const Topics& topics, std::size_t waiting, double now) {
  Diagnosis out{Diagnosis::ok, "camera", fmt::format("{:.1f} Hz", counts.images.hertz(now)), {}};
  if (counts.images.count() == 0) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no image on {}", topics.image);
  } else if (counts.images.silence(now) > 1) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no image on {} for {:.1f} s", topics.image, counts.images.silence(now));
  }
  out.values = {{"topic", topics.image},
                {"rate_hz", fmt::format("{:.1f}", counts.images.hertz(now))},
                {"received", fmt::format("{}", counts.images.count())},
                {"mapped", fmt::format("{}", counts.mapped.count())},
                {"skipped", fmt::format("{}", counts.skipped)},
                {"dropped", fmt::format("{}", counts.dropped)},
                {"waiting", fmt::format("{}", waiting)}};
  for (const auto& [reason, count] : counts.reasons)
    out.values.emplace_back(fmt::format("skipped: {}", reason), fmt::format("{}", count));
  return out;
}

Diagnosis diagnose_calibration(const Counts& counts, const Topics& topics, const CameraInfo* info,
                               const std::string& problem, const Image* newest, double now) {
  Diagnosis out{Diagnosis::ok, "camera_info", "", {}};
  if (info == nullptr) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no sensor_msgs/CameraInfo on {}", topics.camera_info);
  } else if (!problem.empty()) {
    out.level = Diagnosis::error;
    out.message = fmt::format("{}: {}", topics.camera_info, problem);
  } else {
    out.message = fmt::format("{} x {}", info->width, info->height);
    // Of every image that is not compressed the size is known.
    if (newest != nullptr && !newest->compressed &&
        (newest->width != info->width || newest->height != info->height)) {
      out.level = Diagnosis::error;
      out.message = fmt::format("it is for {} x {} pixels, and the images have {} x {}", info->width,
                                info->height, newest->width, newest->height);
    }
  }
  out.values = {{"topic", topics.camera_info},
                {"received", fmt::format("{}", counts.infos.count())},
                {"rate_hz", fmt::format("{:.1f}", counts.infos.hertz(now))}};
  return out;
}

Diagnosis diagnose_mapper(const Counts& counts, double now) {
  Diagnosis out{Diagnosis::ok, "mapper", fmt::format("{:.1f} Hz", counts.mapped.hertz(now)), {}};
  if (counts.mapped.count() == 0) {
    out.level = Diagnosis::error;
    out.message = "nothing is mapped yet";
  } else if (counts.mapped.silence(now) > 1) {
    out.level = Diagnosis::error;
    out.message = fmt::format("nothing was mapped for {:.1f} s", counts.mapped.silence(now));
  } else if (counts.outside_now > 0) {
    out.level = Diagnosis::error;
    out.message = fmt::format("{} points of the newest frame lie beyond what a map can hold, 32768 voxels",
                              counts.outside_now);
  } else if (counts.last_depth < now - 1) {
    out.level = Diagnosis::warning;
    out.message = "no depth: no parallax (hover?) or no texture";
  } else if (!counts.stamps.empty()) {
    out.level = Diagnosis::warning;
    out.message = counts.stamps;
  }
  out.values = {{"rate_hz", fmt::format("{:.1f}", counts.mapped.hertz(now))},
                {"mapped", fmt::format("{}", counts.mapped.count())},
                {"latency_ms", fmt::format("{:.1f}", 1e3 * counts.latency.quantile(0.5))},
                {"latency_95_ms", fmt::format("{:.1f}", 1e3 * counts.latency.quantile(0.95))},
                {"work_ms", fmt::format("{:.1f}", 1e3 * counts.work.quantile(0.5))},
                {"depth_share", fmt::format("{:.2f}", counts.depth_share)},
                {"outside", fmt::format("{}", counts.outside)},
                {"origin", counts.origin},
                {"begun_anew", fmt::format("{}", counts.restarts)},
                {"last_begun_anew", counts.last_restart}};
  return out;
}

}  // namespace pade_ros
