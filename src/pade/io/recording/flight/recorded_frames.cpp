#include "pade/io/recording/flight/recorded_frames.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr std::size_t kDeepest = 64;  // frames above each other: a longer way is a circle

bool same(const Pose& a, const Pose& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

/// What was said of one child by one parent.
struct Said {
  TrajectoryBuilder rows{""};
  std::size_t count = 0;
  bool fixed = false;
};

}  // namespace

std::string frame_name(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  return std::string(name);
}

Result<RecordedFrames> RecordedFrames::read(const Recording& recording, ReadReport& report) {
  std::map<std::string, std::map<std::string, Said>> said;  // child, parent
  for (const Topic& topic : recording.topics()) {
    const auto encoding = message_encoding(topic.encoding);
    if (!encoding || (topic.type != "tf2_msgs/TFMessage" && topic.type != "tf/tfMessage")) continue;
    const bool fixed = topic.name.ends_with("tf_static");
    for (std::size_t i = 0; i < topic.messages.size(); ++i) {
      const auto bytes = recording.read(topic.messages[i]);
      if (!bytes) return bytes.error();
      const auto transforms = read_transforms(*bytes, *encoding);
      if (!transforms) {
        report.skip(topic.name, fmt::format("message {}: {}", i, transforms.error().message));
        continue;
      }
      for (const PoseMessage& transform : *transforms) {
        const std::string child = frame_name(transform.child);
        Said& entry = said[child]
                          .try_emplace(frame_name(transform.header.frame),
                                       Said{TrajectoryBuilder(topic.name + " " + child)})
                          .first->second;
        entry.fixed = entry.fixed || fixed;
        const Time stamp =
            transform.header.stamp.nanoseconds == 0 ? topic.messages[i].time : transform.header.stamp;
        entry.rows.add(++entry.count, stamp, transform.position, transform.xyzw);
      }
    }
  }
  RecordedFrames frames;
  for (auto& [child, parents] : said) {
    // Of several parents the one that speaks most; /tf_static says a thing once, and counts as a few.
    constexpr std::size_t kOnce = 10;
    const auto weight = [](const auto& one) { return one.second.count + (one.second.fixed ? kOnce : 0); };
    auto best = parents.begin();
    for (auto one = parents.begin(); one != parents.end(); ++one)
      if (weight(*one) > weight(*best)) best = one;
    for (auto one = parents.begin(); one != parents.end(); ++one) {
      if (one == best) continue;
      report.skip(child, fmt::format("{} transforms from {} are not used: {} from {} say otherwise",
                                     one->second.count, in_quotes(one->first), best->second.count,
                                     in_quotes(best->first)));
    }
    auto& [parent, what] = *best;
    ReadReport repeated;  // of one stamp: usual in /tf, and harmless
    auto rows = what.rows.finish(repeated);
    if (!rows) {
      report.skip(child, rows.error().message);
      continue;
    }
    const bool still = std::all_of(rows->rows().begin(), rows->rows().end(), [&](const StampedPose& row) {
      return same(row.pose, rows->rows().front().pose);
    });
    frames.edges_[child] = {parent, std::move(*rows), what.fixed || still};
  }
  return frames;
}

std::vector<const RecordedFrames::Edge*> RecordedFrames::above(const std::string& frame) const {
  std::vector<const Edge*> way;
  auto edge = edges_.find(frame);
  while (edge != edges_.end() && way.size() < kDeepest) {
    way.push_back(&edge->second);
    edge = edges_.find(edge->second.parent);
  }
  return way;
}

std::string RecordedFrames::root(const std::string& frame) const {
  const auto way = above(frame);
  return way.empty() ? frame : way.back()->parent;
}

std::string RecordedFrames::carrier(const std::string& frame) const {
  std::string carrier;
  for (const Edge* const edge : above(frame)) {
    if (!edge->fixed) break;
    carrier = edge->parent;
  }
  return carrier;
}

std::optional<Pose> RecordedFrames::fixed(const std::string& a, const std::string& b) const {
  if (a == b) return Pose{};
  // Frames to which `frame` is fixed, with its pose in each.
  const auto reach = [&](const std::string& frame) {
    std::vector<std::pair<std::string, Pose>> reached{{frame, Pose{}}};
    for (const Edge* const edge : above(frame)) {
      if (!edge->fixed) break;
      const Pose& step = edge->rows.rows().front().pose;
      reached.emplace_back(edge->parent, reached.size() == 1 ? step : step * reached.back().second);
    }
    return reached;
  };
  const auto of_a = reach(a);
  const auto of_b = reach(b);
  for (const auto& [frame, T_frame_b] : of_b) {
    for (const auto& [other, T_other_a] : of_a) {
      if (frame != other) continue;
      return frame == a ? T_frame_b : T_other_a.inverse() * T_frame_b;
    }
  }
  return std::nullopt;
}

Result<Trajectory> RecordedFrames::path_of(const std::string& frame, double largest_gap) const {
  const auto way = above(frame);
  const auto moving = std::find_if(way.begin(), way.end(), [](const Edge* edge) { return !edge->fixed; });
  if (moving == way.end()) {
    return Error{fmt::format("the transforms never move {}, expected a chain from the world to the camera",
                             in_quotes(frame))};
  }
  std::vector<StampedPose> rows;
  for (const StampedPose& row : (*moving)->rows.rows()) {
    std::optional<Pose> pose;
    for (const Edge* const edge : way) {
      const bool itself = edge == *moving;
      auto step = itself        ? Result<Pose>(row.pose)
                  : edge->fixed ? Result<Pose>(edge->rows.rows().front().pose)
                                : edge->rows.at(row.time, largest_gap);
      if (!step) {
        pose.reset();
        break;
      }
      pose = pose ? *step * *pose : *step;
    }
    if (pose) rows.push_back({row.time, *pose});
  }
  if (rows.empty())
    return Error{fmt::format("at no moment all transforms from {} to {} are known", in_quotes(root(frame)),
                             in_quotes(frame))};
  return Trajectory(std::move(rows));
}

}  // namespace pade::io
