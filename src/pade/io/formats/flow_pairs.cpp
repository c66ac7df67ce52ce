#include "pade/io/formats/flow_pairs.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".png" || ending == ".jpg" || ending == ".pgm" || ending == ".ppm";
}

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code failure;
  for (fs::directory_iterator it(folder, failure), end; !failure && it != end; it.increment(failure)) {
    entries.push_back(it->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::optional<FlowPair> pair_in(const fs::path& folder) {
  std::vector<fs::path> truths;
  std::vector<fs::path> images;
  for (const fs::path& file : sorted_entries(folder)) {
    const bool named_flow = file.filename().string().starts_with("flow");
    if (file.extension() == ".flo" || (file.extension() == ".png" && named_flow)) {
      truths.push_back(file);
    } else if (is_image(file)) {
      images.push_back(file);
    }
  }
  if (truths.size() != 1 || images.size() != 2) return std::nullopt;
  const fs::path normal = absolute_path(folder).lexically_normal();
  const fs::path name = normal.has_filename() ? normal.filename() : normal.parent_path().filename();
  return FlowPair{name.string(), images[0], images[1], truths[0]};
}

}  // namespace

Result<std::vector<FlowPair>> find_flow_pairs(const fs::path& folder) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure)) return Error{fmt::format("{}: not a folder", folder.string())};
  std::vector<FlowPair> pairs;
  if (auto pair = pair_in(folder)) pairs.push_back(*std::move(pair));
  for (const fs::path& entry : sorted_entries(folder)) {
    if (!fs::is_directory(entry, failure)) continue;
    if (auto pair = pair_in(entry)) pairs.push_back(*std::move(pair));
  }
  if (pairs.empty()) {
    return Error{
        fmt::format("{}: no folder with two images and a true flow (*.flo or flow*.png)", folder.string())};
  }
  return pairs;
}

}  // namespace pade::io
