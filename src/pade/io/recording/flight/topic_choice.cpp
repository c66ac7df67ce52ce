#include "pade/io/recording/flight/topic_choice.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/text.hpp"

namespace pade::io {

TopicChoice::TopicChoice(std::string_view names) {
  for (const std::string_view name : split_fields(names)) {
    if (!name.empty()) names_.emplace_back(name);
  }
}

Status TopicChoice::check(const Recording& recording) const {
  for (const std::string& name : names_) {
    const auto& topics = recording.topics();
    if (std::any_of(topics.begin(), topics.end(), [&](const Topic& topic) { return topic.name == name; }))
      continue;
    std::vector<const Topic*> all;
    for (const Topic& topic : topics) all.push_back(&topic);
    return Error{fmt::format("{}: found no topic {}, expected one of {}", recording.file().string(),
                             in_quotes(name), list_of(all))};
  }
  return {};
}

bool TopicChoice::names(const Topic& topic) const {
  return std::find(names_.begin(), names_.end(), topic.name) != names_.end();
}

Result<const Topic*> TopicChoice::among(const Recording& recording,
                                        const std::vector<const Topic*>& candidates,
                                        std::string_view what) const {
  std::vector<const Topic*> named;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(named),
               [&](const Topic* topic) { return names(*topic); });
  const auto& left = named.empty() ? candidates : named;
  if (left.empty()) return static_cast<const Topic*>(nullptr);
  if (left.size() == 1) return left.front();
  return Error{fmt::format("{}: found {} topics with {}, expected one: name it with --topics: {}",
                           recording.file().string(), left.size(), what, list_of(left))};
}

std::vector<const Topic*> topics_of(const Recording& recording, const std::vector<std::string_view>& types) {
  std::vector<const Topic*> found;
  for (const Topic& topic : recording.topics()) {
    const bool wanted = std::find(types.begin(), types.end(), topic.type) != types.end();
    if (wanted && !topic.messages.empty() && message_encoding(topic.encoding)) found.push_back(&topic);
  }
  return found;
}

std::string list_of(const std::vector<const Topic*>& topics) {
  std::string text;
  for (const Topic* const topic : topics) {
    text += fmt::format("{}{} ({}, {})", text.empty() ? "" : ", ", topic->name, topic->type,
                        topic->messages.size());
  }
  return text;
}

}  // namespace pade::io
