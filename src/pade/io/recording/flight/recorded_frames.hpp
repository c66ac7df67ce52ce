// Coordinate frames of a recording, as /tf and /tf_static tell how they lie to each other.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/skipped.hpp"

namespace pade::io {

/// "base_link" of "/base_link", as old programs write it.
std::string frame_name(std::string_view name);

/// A tree of frames, each with the pose of a child in its parent.
class RecordedFrames {
 public:
  /// All transforms of a recording. Those that cannot be used are skipped and said.
  static Result<RecordedFrames> read(const Recording& recording, ReadReport& report);

  [[nodiscard]] bool empty() const { return edges_.empty(); }
  /// T_a_b, if no transform between them ever moves.
  [[nodiscard]] std::optional<Pose> fixed(const std::string& a, const std::string& b) const;
  /// The frame farthest up to which nothing moves: the vehicle that carries a camera. Empty if there is none
  /// above.
  [[nodiscard]] std::string carrier(const std::string& frame) const;
  /// Where a frame was in the root of the tree, at the times of the lowest transform that moves. Between rows
  /// of the others at most `largest_gap` seconds are bridged. Errors: none moves, or no moment has all.
  [[nodiscard]] Result<Trajectory> path_of(const std::string& frame, double largest_gap) const;
  /// The root of the tree above a frame.
  [[nodiscard]] std::string root(const std::string& frame) const;

 private:
  struct Edge {
    std::string parent;
    Trajectory rows;  ///< T_parent_child
    bool fixed = false;
  };
  [[nodiscard]] std::vector<const Edge*> above(const std::string& frame) const;
  std::map<std::string, Edge, std::less<>> edges_;  // by child
};

}  // namespace pade::io
