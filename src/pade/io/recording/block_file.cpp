#include "pade/io/recording/block_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pade::io {

Result<RandomFile> RandomFile::open(const std::filesystem::path& file) {
  const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return Error{fmt::format("{}: {}", file.string(), std::strerror(errno))};
  struct stat state = {};
  if (::fstat(handle, &state) != 0 || !S_ISREG(state.st_mode)) {
    ::close(handle);
    return Error{fmt::format("{}: not a regular file", file.string())};
  }
  return RandomFile(handle, static_cast<std::uint64_t>(state.st_size), file.string());
}

RandomFile::RandomFile(RandomFile&& other) noexcept
    : handle_(std::exchange(other.handle_, -1)), size_(other.size_), name_(std::move(other.name_)) {}

RandomFile::~RandomFile() {
  if (handle_ >= 0) ::close(handle_);
}

Result<std::string> RandomFile::read(std::uint64_t offset, std::uint64_t count) const {
  if (offset > size_ || count > size_ - offset) {
    return damage(offset, fmt::format("the file ends at byte {}, expected {} more bytes here", size_, count));
  }
  std::string bytes(count, '\0');
  for (std::uint64_t done = 0; done < count;) {
    const ssize_t got =
        ::pread(handle_, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return damage(offset + done, "cannot be read");
    done += static_cast<std::uint64_t>(got);
  }
  return bytes;
}

Error RandomFile::damage(std::uint64_t at, std::string_view what) const {
  return Error{fmt::format("{}: byte {}: {}", name_, at, what)};
}

Result<std::string> read_block(const RandomFile& file, const Block& block) {
  auto bytes = file.read(block.offset, block.size);
  if (!bytes || block.compression == Compression::none) return bytes;
  auto content = decompressed(block.compression, *bytes, block.content);
  if (!content) return file.damage(block.offset, content.error().message);
  return content;
}

Result<std::string> BlockSource::read(const MessagePlace& place, std::size_t most) const {
  const std::uint64_t count = std::min<std::uint64_t>(place.size, most);
  if (place.block == kNoBlock) return file_.read(place.offset, count);
  const std::lock_guard lock(mutex_);
  if (cached_ != place.block) {
    auto content = read_block(file_, blocks_[place.block]);
    if (!content) return content;
    content_ = std::move(*content);
    cached_ = place.block;
  }
  if (place.offset > content_.size() || place.size > content_.size() - place.offset)
    return file_.damage(blocks_[place.block].offset, "the block has changed since it was read first");
  return content_.substr(place.offset, count);
}

}  // namespace pade::io
