// Which topics of a recording are meant: found by their types, asked for where several fit.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/recording/recording.hpp"

namespace pade::io {

/// Names that a user gave, separated by blanks or commas.
class TopicChoice {
 public:
  explicit TopicChoice(std::string_view names);

  /// Error if one of the names is none of the recording's topics.
  [[nodiscard]] Status check(const Recording& recording) const;
  [[nodiscard]] bool names(const Topic& topic) const;
  /// The topic among the candidates: the one that is named, or the only one. Null if there are none. Error if
  /// several fit and none, or more than one, is named.
  /// @param what  "images", for the message
  [[nodiscard]] Result<const Topic*> among(const Recording& recording,
                                           const std::vector<const Topic*>& candidates,
                                           std::string_view what) const;

 private:
  std::vector<std::string> names_;
};

/// Topics with messages that are of one of the types, and written in a way that is understood.
std::vector<const Topic*> topics_of(const Recording& recording, const std::vector<std::string_view>& types);

/// "/odom (nav_msgs/Odometry, 120), ...".
std::string list_of(const std::vector<const Topic*>& topics);

}  // namespace pade::io
