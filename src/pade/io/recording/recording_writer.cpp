#include "pade/io/recording/recording_writer.hpp"

#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/lasting_output.hpp"
#include "pade/io/text.hpp"

namespace pade::io {

namespace fs = std::filesystem;

Result<PartialFile> PartialFile::create(const fs::path& target, Overwrite overwrite, bool keep) {
  if (overwrite == Overwrite::refuse && path_exists(target))
    return Error{
        fmt::format("{}: exists already, expected a new file (--force replaces it)", target.string())};
  std::error_code failure;
  if (target.has_parent_path()) fs::create_directories(target.parent_path(), failure);
  PartialFile file;
  file.target_ = target;
  file.place_ = target;
  file.place_ += ".part";
  file.keep_ = keep;
  file.stream_.open(file.place_, std::ios::binary | std::ios::trunc);
  if (!file.stream_) {
    file.place_.clear();
    return Error{fmt::format("{}: cannot be written", target.string())};
  }
  return file;
}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : target_(std::move(other.target_)),
      place_(std::exchange(other.place_, {})),
      stream_(std::move(other.stream_)),
      size_(other.size_),
      keep_(other.keep_),
      synced_(other.synced_) {}

PartialFile::~PartialFile() {
  if (place_.empty() || keep_) return;
  stream_.close();
  std::error_code failure;
  fs::remove(place_, failure);
}

void PartialFile::append(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  size_ += bytes.size();
}

void PartialFile::overwrite(std::uint64_t at, std::string_view bytes) {
  stream_.seekp(static_cast<std::streamoff>(at));
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream_.seekp(0, std::ios::end);
}

Status PartialFile::flush() {
  stream_.flush();
  if (!stream_) return Error{fmt::format("{}: cannot be written (no space left?)", place_.string())};
  constexpr auto kPause = std::chrono::seconds(1);
  const auto now = std::chrono::steady_clock::now();
  if (!keep_ || now - synced_ < kPause) return {};
  synced_ = now;
  return sync_to_disk(place_);
}

Status PartialFile::commit() {
  if (Status status = flush(); !status) return status;
  stream_.close();
  if (keep_) {
    if (Status status = sync_to_disk(place_); !status) return status;
  }
  std::error_code failure;
  fs::rename(place_, target_, failure);
  if (failure) return Error{fmt::format("{}: cannot be made: {}", target_.string(), failure.message())};
  place_.clear();
  return keep_ ? sync_to_disk(fs::absolute(target_, failure).parent_path()) : Status();
}

Result<std::unique_ptr<RecordingWriter>> create_recording(const fs::path& file, Overwrite overwrite,
                                                          bool keep) {
  const std::string ending = file.extension().string();
  if (ending != ".bag" && ending != ".mcap")
    return Error{
        fmt::format("{}: found the ending {}, expected .bag or .mcap", file.string(), in_quotes(ending))};
  auto part = PartialFile::create(file, overwrite, keep);
  if (!part) return part.error();
  return ending == ".bag" ? bag_writer(std::move(*part)) : mcap_writer(std::move(*part));
}

}  // namespace pade::io
