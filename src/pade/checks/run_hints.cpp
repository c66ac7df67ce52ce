#include "pade/checks/run_hints.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::evaluation {
namespace {

using io::RunInfo;

// Shares from which on a run is said to be poor. Flights over textured ground are far from all of them.
constexpr double kFewMeasured = 0.2;    // of the pixels
constexpr double kHardlyAny = 0.01;     // of the pixels: a map cannot come of them
constexpr double kMost = 0.5;           // of depths, pairs, frames, points, the image
constexpr double kManyUncertain = 0.8;  // of the depths
constexpr double kSomeFrames = 0.1;     // of the frames, of the points
constexpr double kFewPoints = 0.02;     // of the points
constexpr double kContradicted = 0.4;   // of the pixels: poses that fit leave under a tenth inconsistent

/// 0 of nothing.
template <class Count>
double share(Count part, Count whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

std::string percent(double share) {
  return fmt::format("{:.{}f} %", 100 * share, share > 0 && share < 0.1 ? 1 : 0);
}

/// Whether an option of the run reads so: "/mapper/map/range".
std::optional<nlohmann::json> option(const RunInfo& info, const char* path) {
  const auto options = nlohmann::json::parse(info.options, nullptr, false);
  const nlohmann::json::json_pointer pointer(path);
  if (!options.is_object() || !options.contains(pointer)) return std::nullopt;
  return options.at(pointer);
}

/// Message and advice.
struct Reason {
  std::string message, advice;
};

std::uint64_t pixels_of(const RunInfo& info) {
  return std::accumulate(info.state_pixels.begin(), info.state_pixels.end(), std::uint64_t{0});
}

double share_of(const RunInfo& info, DepthState state) {
  return share(info.state_pixels[static_cast<std::size_t>(state)], pixels_of(info));
}

std::string baseline_text(const RunInfo& info) {
  const double baseline = info.motion.baseline;
  return baseline < 1
             ? fmt::format("it moves {:.3g} cm between the frames of a pair (median)", 100 * baseline)
             : fmt::format("it moves {:.3g} m between the frames of a pair (median)", baseline);
}

/// Depth beyond the range nearly everywhere: the scene is far, or the poses move far too much.
Reason why_far(const RunInfo& info) {
  const std::string name =
      fmt::format("{} of the pixels are \"far\"", percent(share_of(info, DepthState::far)));
  const double range = info.range_limit > 0 ? info.range_limit : 20;
  if (info.motion.baseline > 0.5 * range) {
    return {name + ": " + baseline_text(info) +
                ", more than half the range: positions in millimetres or of another flight?",
            "let `pade info FLIGHT` try the poses on the images"};
  }
  return {name + fmt::format(": nothing is nearer than the range of {:g} m", range),
          "raise --range and --map-range, fly nearer, or let `pade info FLIGHT` try the poses on the images"};
}

/// Why pixels have no depth, by the state that most of them have.
Reason why_unmeasured(const RunInfo& info) {
  if (share_of(info, DepthState::far) > kMost) return why_far(info);
  constexpr std::array kWithoutDepth = {DepthState::epipole, DepthState::low_parallax, DepthState::no_texture,
                                        DepthState::inconsistent, DepthState::out_of_view};
  const DepthState state =
      *std::max_element(kWithoutDepth.begin(), kWithoutDepth.end(),
                        [&](DepthState a, DepthState b) { return share_of(info, a) < share_of(info, b); });
  const std::string name = fmt::format("{} of the pixels are \"{}\"", percent(share_of(info, state)),
                                       depth_state_names[static_cast<std::size_t>(state)]);
  switch (state) {
    case DepthState::low_parallax:
      return {name + ": the scene is far, or the camera hardly moves; " + baseline_text(info),
              "pair frames that are farther apart (--step 2, 4, 8), or fly faster or nearer"};
    case DepthState::epipole:
      return {name + ": the camera flies straight at what it sees, or hardly moves; " + baseline_text(info),
              "pair frames that are farther apart (--step 2, 4, 8), or fly with some sideways motion"};
    case DepthState::inconsistent:
      return {name +
                  ": the images contradict the poses (convention, time offset or calibration), or most of "
                  "what is seen moves by itself",
              "let `pade info FLIGHT` try the poses on the images; check time_offset_s and camera.yaml"};
    case DepthState::out_of_view:
      if (info.masked_share > kMost) {
        return {name + fmt::format(": the mask covers {} of the image", percent(info.masked_share)),
                "check mask.png: 0 only where the image never shows the scene"};
      }
      return {name + ": the view changes so much between the frames of a pair that they share little",
              "take more frames per second, or turn and fly more slowly"};
    default:
      return {name + ": the images are dark, blurred or out of focus, or the scene is without structure",
              "check exposure and focus of the images, and take the lowest compression"};
  }
}

/// Why depths are too uncertain to place anything: the poses, or the pixels themselves.
Reason why_uncertain(const RunInfo& info) {
  const io::MotionSummary& motion = info.motion;
  if (motion.rotation_sigma > 0 || motion.direction_sigma > 0) {
    const auto refined = option(info, "/mapper/refinement/on");
    const bool off = refined && *refined == false;
    return {
        fmt::format("the motion between frames is known to {:.2g}° in rotation and {:.2g}° in direction "
                    "only (1 σ, median), over {:.3g} cm",
                    motion.rotation_sigma, motion.direction_sigma, 100 * motion.baseline),
        off ? "let the images refine the motion (--refine-motion on)"
            : "give better poses (--poses, --imu), pair frames that are farther apart (--step 2, 4, 8), or "
              "map nearer things only"};
  }
  return {fmt::format("the parallax is small for the distance of the scene; the camera moves {:.3g} cm "
                      "between the frames of a pair (median)",
                      100 * motion.baseline),
          "pair frames that are farther apart (--step 2, 4, 8), take a better flow method (--flow), or fly "
          "nearer"};
}

Reason outside_reason(const RunInfo& info) {
  return {fmt::format("the octree reaches {:.0f} m from the origin with voxels of {:g} m, and the poses lie "
                      "farther away (map coordinates such as UTM?)",
                      32768 * info.map->voxel, info.map->voxel),
          "let the run be made around a point near the flight (--origin flight), or take larger voxels "
          "(--voxel)"};
}

Reason beyond_reason(const RunInfo& info) {
  const auto range = option(info, "/mapper/map/range");
  const std::string text = range && range->is_number() ? fmt::format(" of {:g} m", range->get<double>()) : "";
  return {"the scene is farther than the range" + text + " up to which the map is updated",
          "raise --map-range (and --range with it), or fly nearer"};
}

/// Counts of depths that the map could have used: within its range.
std::uint64_t depths_in_range(const io::MapSummary& map) { return map.depths - map.depths_beyond; }

/// The likeliest reason for a map without obstacles, from the first stage that left nothing.
Reason why_empty(const RunInfo& info) {
  const io::MapSummary& map = *info.map;
  if (share(map.depths, pixels_of(info)) < kHardlyAny) return why_unmeasured(info);
  if (share(map.depths_beyond, map.depths) > kMost) return beyond_reason(info);
  const std::uint64_t sure = depths_in_range(map) - map.depths_uncertain;
  if (map.points_outside > 0 && share(map.points_outside, sure) > kMost) return outside_reason(info);
  if (share(map.depths_uncertain, depths_in_range(map)) > kMost) return why_uncertain(info);
  if (map.hits == 0) {
    return {
        "no voxel gets enough points: they are scattered",
        "take larger voxels (--voxel 0.2), a better flow method (--flow), or lower hit_min_share in a file "
        "of options (--config)"};
  }
  return {fmt::format("{} hits were taken back by later images that look through them: the depths or the "
                      "poses contradict each other",
                      map.hits),
          "let `pade info FLIGHT` try the poses on the images; look at depth and σ on the report"};
}

class List {
 public:
  void add(std::string_view id, HintSeverity severity, const std::string& found, Reason reason) {
    const std::string because = reason.message.empty() ? "" : fmt::format(": {}", reason.message);
    hints_.push_back({std::string(id), severity, found + because, std::move(reason.advice)});
  }
  std::vector<Hint> take() {
    std::stable_sort(hints_.begin(), hints_.end(),
                     [](const Hint& a, const Hint& b) { return a.severity > b.severity; });
    return std::move(hints_);
  }

 private:
  std::vector<Hint> hints_;
};

void add_of_map(const RunInfo& info, List& list) {
  if (!info.map) return;
  const io::MapSummary& map = *info.map;
  if (map.occupied_voxels == 0) {
    const double measured = share_of(info, DepthState::measured);
    list.add("empty-map", HintSeverity::error,
             fmt::format("the map is empty: no voxel is occupied although {} of the pixels have depth",
                         percent(measured)),
             why_empty(info));
    return;
  }
  const std::uint64_t in_range = depths_in_range(map);
  const std::uint64_t sure = in_range - map.depths_uncertain;
  if (const double outside = share(map.points_outside, sure); outside > kFewPoints) {
    list.add("outside-map", HintSeverity::warning,
             fmt::format("{} of the points lie outside the map and were lost", percent(outside)),
             outside_reason(info));
  }
  if (const double uncertain = share(map.depths_uncertain, in_range); uncertain > kManyUncertain) {
    list.add("mostly-uncertain", HintSeverity::warning,
             fmt::format("{} of the depths are too uncertain to place an obstacle", percent(uncertain)),
             why_uncertain(info));
  }
  if (const double beyond = share(map.depths_beyond, map.depths); beyond > kMost) {
    list.add("beyond-map", HintSeverity::warning,
             fmt::format("{} of the depths lie beyond the map", percent(beyond)), beyond_reason(info));
  }
  if (map.free_voxels < map.occupied_voxels) {
    list.add("nothing-free", HintSeverity::warning,
             fmt::format("the map has obstacles but {}: nothing tells a planner where it may fly",
                         map.free_voxels == 0 ? "no free space" : "hardly any free space"),
             {"too few pixels around each free voxel have depth, or the images of different places "
              "contradict each other",
              "let `pade info FLIGHT` try the poses on the images; look at the states on the report"});
  }
}

void add_of_pixels(const RunInfo& info, List& list) {
  if (pixels_of(info) == 0) return;
  const double known = share_of(info, DepthState::measured) + share_of(info, DepthState::far);
  if (known < kFewMeasured) {
    list.add("mostly-unmeasured", HintSeverity::warning,
             fmt::format("only {} of the pixels have depth", percent(share_of(info, DepthState::measured))),
             why_unmeasured(info));
  }
  if (const double contradicted = share_of(info, DepthState::inconsistent);
      known >= kFewMeasured && contradicted > kContradicted) {
    list.add("images-contradict-poses", HintSeverity::warning,
             fmt::format("{} of the pixels contradict the poses", percent(contradicted)),
             {"convention, unit, time offset or calibration of the poses are wrong, or most of what is seen "
              "moves by "
              "itself",
              "let `pade info FLIGHT` try the poses on the images; check time_offset_s and camera.yaml"});
  }
  if (const auto& offset = info.motion.stamp_offset; offset && offset->is_certain()) {
    const bool late = offset->seconds < 0;
    list.add(late ? "stamps-late" : "stamps-early", HintSeverity::warning,
             fmt::format("the images' stamps are {:.1f} ms {} (1 sigma {:.1f} ms, from {} uneven turns)",
                         1e3 * std::abs(offset->seconds), late ? "late" : "early", 1e3 * offset->sigma,
                         offset->pairs),
             {"while the camera turns, poses and images are of different moments",
              fmt::format("add {:.4f} to time_offset_s in camera.yaml", offset->seconds)});
  }
  if (info.masked_share > kMost) {
    list.add("large-mask", HintSeverity::warning,
             fmt::format("{} of the image is masked", percent(info.masked_share)),
             {"", "check mask.png: 0 only where the image never shows the scene"});
  }
  const double still = share(info.motion.still_pairs, info.motion.pairs);
  if (still > kMost) {
    list.add("standing-still", HintSeverity::warning,
             fmt::format("the camera hardly moves in {} of the pairs of frames", percent(still)),
             {"hovering, turning on the spot, or frames that follow each other too closely; " +
                  baseline_text(info),
              "pair frames that are farther apart (--step 2, 4, 8), or map a part of the flight that moves"});
  }
}

void add_of_frames(const RunInfo& info, List& list) {
  const io::RunHealth& health = info.health;
  const double without = share(health.frames_without_pose, health.frames);
  if (without > kSomeFrames) {
    list.add("poses-refused", HintSeverity::warning,
             fmt::format("{} of {} frames ({}) have no pose", health.frames_without_pose, health.frames,
                         percent(without)),
             {"the poses begin late, end early or have gaps, or the filter did not know its yaw yet",
              "compare the times with `pade info FLIGHT`; with from-imu-gnss accelerate or turn early "
              "in the flight, or record mag.csv"});
  }
  if (share(health.motions_without_scale, health.frames_used) > kMost) {
    list.add(
        "poses-too-short", HintSeverity::warning,
        fmt::format("{} motions between frames are too short for what the filter knows of them",
                    health.motions_without_scale),
        {"the vehicle flies slowly for the accuracy of its GNSS velocity, and every depth is uncertain by "
         "the same factor",
         "pair frames that are farther apart (--step 2, 4, 8)"});
  }
  const int skipped = health.frames - health.frames_used - health.frames_without_pose;
  if (share(skipped, health.frames) > kSomeFrames) {
    list.add("frames-skipped", HintSeverity::warning,
             fmt::format("{} of {} frames were left out", skipped, health.frames),
             {health.skipped.empty() ? "" : "the first because " + health.skipped.front().reason,
              "see the list of what was skipped; record the flight again where images are damaged"});
  }
}

}  // namespace

std::vector<Hint> hints_of(const RunInfo& info) {
  List list;
  if (info.health.depth_images == 0) {
    list.add("no-depth", HintSeverity::error, "no pair of frames gave a depth image",
             {fmt::format("only {} frames could be used", info.health.frames_used),
              "map more frames, or pair them more closely (--step 1)"});
    add_of_frames(info, list);
    return list.take();
  }
  add_of_map(info, list);
  add_of_pixels(info, list);
  add_of_frames(info, list);
  return list.take();
}

std::string to_table(const std::vector<Hint>& hints) {
  std::string text;
  for (const Hint& hint : hints) {
    text += fmt::format("{:14} {}\n{:14} -> {}\n", hint.severity == HintSeverity::error ? "ERROR" : "Warning",
                        hint.message, "", hint.advice);
  }
  return text;
}

}  // namespace pade::evaluation
