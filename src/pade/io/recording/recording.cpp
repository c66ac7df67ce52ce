#include "pade/io/recording/recording.hpp"

#include <algorithm>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/mcap_format.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSqlite("SQLite format 3\0", 16);

std::string first_bytes(const fs::path& file) {
  std::string bytes(16, '\0');
  std::error_code failure;
  if (!fs::is_regular_file(file, failure)) return {};
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return bytes;
}

bool is_file_of_one(const fs::path& file) {
  const std::string head = first_bytes(file);
  return head.starts_with("#ROSBAG V") || head.starts_with(mcap::kMagic) || head == kSqlite;
}

/// The recordings in a folder of rosbag2, by name.
std::vector<fs::path> recordings_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    const std::string ending = entry->path().extension().string();
    if (ending == ".db3" || ending == ".mcap") files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool is_folder_of_one(const fs::path& folder) {
  return path_exists(folder / "metadata.yaml") && !recordings_in(folder).empty();
}

Result<Recording::Content> read_content(const fs::path& file) {
  const std::string head = first_bytes(file);
  if (head.starts_with(mcap::kMagic)) return read_mcap(file);
  if (head == kSqlite) return read_rosbag2(file);
  if (head.starts_with("#ROSBAG V2.0\n")) return read_bag(file);
  if (head.starts_with("#ROSBAG V"))
    return Error{fmt::format(
        "{}: found a bag of version {}, expected 2.0 (rosbag fix, or rosbag decompress, writes it)",
        file.string(), head.substr(9, 3))};
  return Error{
      fmt::format("{}: found no recording, expected rosbag 2.0, MCAP or rosbag2's SQLite", file.string())};
}

/// Topics of one name and type are one; messages in the order of their times.
std::vector<Topic> tidied(std::vector<Topic> topics) {
  for (Topic& topic : topics) {
    if (const std::size_t at = topic.type.find("/msg/"); at != std::string::npos) topic.type.erase(at, 4);
  }
  std::stable_sort(topics.begin(), topics.end(),
                   [](const Topic& a, const Topic& b) { return a.name < b.name; });
  std::vector<Topic> out;
  for (Topic& topic : topics) {
    if (!out.empty() && out.back().name == topic.name && out.back().type == topic.type &&
        out.back().encoding == topic.encoding) {
      out.back().messages.insert(out.back().messages.end(), topic.messages.begin(), topic.messages.end());
    } else {
      out.push_back(std::move(topic));
    }
  }
  for (Topic& topic : out) {
    std::stable_sort(topic.messages.begin(), topic.messages.end(),
                     [](const MessagePlace& a, const MessagePlace& b) { return a.time < b.time; });
  }
  return out;
}

}  // namespace

bool is_recording(const fs::path& path) {
  std::error_code failure;
  return fs::is_directory(path, failure) ? is_folder_of_one(path) : is_file_of_one(path);
}

std::optional<std::string> why_no_recording(const fs::path& folder) {
  std::error_code failure;
  bool compressed = false, split = false;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    const std::string name = entry->path().filename().string();
    for (const char* const ending : {".mcap", ".db3", ".bag"}) {
      split = split || name.ends_with(ending);
      compressed = compressed || name.ends_with(std::string(ending) + ".zstd") ||
                   name.ends_with(std::string(ending) + ".zst");
    }
  }
  if (compressed) {
    return "found recordings that are compressed as a whole (.zstd), expected .mcap, .db3 or .bag: "
           "decompress "
           "them (zstd -d), and name the file";
  }
  if (split)
    return "found recordings in it and no metadata.yaml: name the file itself (.mcap, .db3 or .bag), or make "
           "the "
           "metadata with ros2 bag reindex";
  return std::nullopt;
}

Result<Recording> Recording::open(const fs::path& path) {
  Recording recording;
  recording.file_ = path;
  std::error_code failure;
  if (fs::is_directory(path, failure)) {
    const std::vector<fs::path> files = recordings_in(path);
    if (files.size() != 1) {
      return Error{fmt::format("{}: found {} recordings in it, expected one: name the file ({})",
                               path.string(), files.size(),
                               files.empty() ? "" : files[0].filename().string() + " ...")};
    }
    recording.file_ = files[0];
  }
  auto content = read_content(recording.file_);
  if (!content) return content.error();
  recording.format_ = std::move(content->format);
  recording.topics_ = tidied(std::move(content->topics));
  recording.remarks_ = std::move(content->remarks);
  recording.source_ = std::move(content->source);
  return recording;
}

}  // namespace pade::io
