#include "pade/io/atomic_output.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "pade/io/lasting_output.hpp"

namespace pade::io {
namespace fs = std::filesystem;
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

extern "C" void on_interrupt(int signal_number) {
  interrupt_flag = 1;
  std::signal(signal_number, SIG_DFL);  // whoever asks twice means it
}

Error os_error(const fs::path& path, std::string_view what, int number) {
  return {fmt::format("{}: {}: {}", path.string(), what, std::generic_category().message(number))};
}

// Unique among the processes and the outputs of this one that are under way.
fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  return target.parent_path() /
         fmt::format(".{}.partial-{}-{}", target.filename().string(), ::getpid(), counter++);
}

// The real place of the output: absolute, links followed, no trailing slash.
Result<fs::path> resolve(const fs::path& path) {
  std::error_code code;
  fs::path resolved = fs::weakly_canonical(fs::absolute(path, code), code);
  if (code) return os_error(path, "not a usable path", code.value());
  if (!resolved.has_filename()) resolved = resolved.parent_path();
  if (!resolved.has_filename()) return Error{fmt::format("{}: found no name for the output", path.string())};
  return resolved;
}

/// Whether a call that waits for the disk has failed. Pipes and some file systems have no disk to wait for.
bool sync_failed(int result) { return result != 0 && errno != EINVAL && errno != ENOTSUP && errno != EROFS; }

/// A file that is being written, small pieces gathered to larger ones. The first error stays and ends it.
class FileWriter {
 public:
  FileWriter(const fs::path& path, int flags)
      : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666)) {
    if (file_ < 0) status_ = os_error(path_, "cannot be opened for writing", errno);
  }
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  ~FileWriter() {
    if (file_ >= 0) ::close(file_);
  }

  void add(std::string_view piece) {
    constexpr std::size_t kGathered = 1 << 16;
    if (gathered_.size() + piece.size() > kGathered) flush();
    if (piece.size() > kGathered) {
      put(piece);
    } else {
      gathered_ += piece;
    }
  }

  /// Waits until all is on the disk.
  void sync() {
    flush();
    if (status_ && sync_failed(::fdatasync(file_))) fail();
  }

  Status close() {
    flush();
    // Network file systems report a full disk only here.
    if (status_ && ::close(std::exchange(file_, -1)) != 0) fail();
    return status_;
  }

 private:
  void fail() { status_ = os_error(path_, "cannot be written", errno); }
  void flush() {
    put(gathered_);
    gathered_.clear();
  }
  void put(std::string_view bytes) {
    while (status_ && !bytes.empty()) {
      const ssize_t written = ::write(file_, bytes.data(), bytes.size());
      if (written >= 0) {
        bytes.remove_prefix(static_cast<std::size_t>(written));
      } else if (errno != EINTR) {
        fail();
      }
    }
  }

  const fs::path& path_;
  int file_;
  std::string gathered_;
  Status status_;
};

Status write_bytes(const fs::path& path, const ByteSource& content, int flags, bool lasting = false) {
  FileWriter file(path, flags);
  content([&](std::string_view piece) { file.add(piece); });
  if (lasting) file.sync();
  return file.close();
}

ByteSource source_of(std::string_view content) {
  return [content](const ByteSink& sink) { sink(content); };
}

// First of `path` and its parents that does not exist yet has an existing parent; that one is returned.
fs::path topmost_missing(fs::path path) {
  std::error_code code;
  fs::path missing;
  while (!path.empty() && !fs::exists(path, code)) {
    missing = path;
    if (path == path.parent_path()) break;
    path = path.parent_path();
  }
  return missing;
}

Status check_existing_folder(const fs::path& target, Overwrite overwrite, std::string_view marker) {
  std::error_code code;
  const fs::file_status status = fs::symlink_status(target, code);
  if (status.type() == fs::file_type::not_found) return {};
  if (code) return os_error(target, "cannot be examined", code.value());
  if (!fs::is_directory(status)) {
    return Error{fmt::format("{}: found a file, expected the name of a new folder", target.string())};
  }
  if (overwrite == Overwrite::refuse) {
    return Error{fmt::format("{}: the folder exists; choose another with --out or replace it with --force",
                             target.string())};
  }
  if (fs::is_empty(target, code) || fs::exists(target / marker, code)) return {};
  return Error{fmt::format("{}: found a folder without {}; --force replaces only what an earlier run wrote",
                           target.string(), marker)};
}

}  // namespace

void watch_for_interrupts() {
  for (const int number : {SIGINT, SIGTERM}) {
    if (std::signal(number, on_interrupt) == SIG_IGN) std::signal(number, SIG_IGN);
  }
  std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() { return interrupt_flag != 0; }

Error interrupted_error() { return {"interrupted; nothing was written"}; }
Error interrupted_and_kept_error() {
  return {"interrupted; what was finished is kept, and the same command goes on from there"};
}

std::string bytes_of(const ByteSource& source) {
  std::string bytes;
  source([&](std::string_view piece) { bytes += piece; });
  return bytes;
}

Result<OutputFolder> OutputFolder::create(const fs::path& target, Overwrite overwrite,
                                          std::string_view marker) {
  const Result<fs::path> resolved = resolve(target);
  if (!resolved) return resolved.error();
  if (Status status = check_existing_folder(*resolved, overwrite, marker); !status) return status.error();

  OutputFolder folder;
  folder.target_ = *resolved;
  folder.overwrite_ = overwrite;
  std::error_code code;
  folder.created_parents_ = topmost_missing(resolved->parent_path());
  fs::create_directories(resolved->parent_path(), code);
  if (code) return os_error(resolved->parent_path(), "cannot be made", code.value());
  folder.temporary_ = temporary_beside(folder.target_);
  if (!fs::create_directory(folder.temporary_, code) || code) {
    const fs::path parent = folder.target_.parent_path();
    folder.temporary_.clear();
    return os_error(parent, "the output cannot be written there", code ? code.value() : EEXIST);
  }
  return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      created_parents_(std::exchange(other.created_parents_, {})),
      overwrite_(other.overwrite_) {}

OutputFolder& OutputFolder::operator=(OutputFolder&& other) noexcept {
  if (this != &other) {
    discard();
    target_ = std::move(other.target_);
    temporary_ = std::exchange(other.temporary_, {});
    created_parents_ = std::exchange(other.created_parents_, {});
    overwrite_ = other.overwrite_;
  }
  return *this;
}

OutputFolder::~OutputFolder() { discard(); }

void OutputFolder::discard() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
  temporary_.clear();
  // Parents that create() made go as well, from the innermost outwards, where nobody else has used them.
  if (!created_parents_.empty()) {
    for (fs::path parent = target_.parent_path(); fs::remove(parent, ignored);
         parent = parent.parent_path()) {
      if (parent == created_parents_) break;
    }
  }
  created_parents_.clear();
}

Result<fs::path> OutputFolder::place(const fs::path& relative) const {
  const fs::path path = temporary_ / relative;
  std::error_code code;
  fs::create_directories(path.parent_path(), code);
  if (code) return os_error(path.parent_path(), "cannot be made", code.value());
  return path;
}

Status OutputFolder::write(const fs::path& relative, const ByteSource& content) const {
  const Result<fs::path> path = place(relative);
  if (!path) return path.error();
  return write_bytes(*path, content, O_CREAT | O_TRUNC);
}

Status OutputFolder::write(const fs::path& relative, std::string_view content) const {
  return write(relative, source_of(content));
}

Status OutputFolder::write(const fs::path& relative, std::span<const unsigned char> content) const {
  return write(relative, std::string_view(reinterpret_cast<const char*>(content.data()), content.size()));
}

Status OutputFolder::commit() {
  if (Status status = put_in_place(temporary_, target_, overwrite_); !status) return status;
  temporary_.clear();
  created_parents_.clear();
  return {};
}

Status put_in_place(const fs::path& finished, const fs::path& target, Overwrite overwrite) {
  std::error_code code;
  const bool exists = fs::exists(target, code);
  if (exists && overwrite == Overwrite::refuse && !fs::is_empty(target, code)) {
    return Error{fmt::format("{}: the folder was made by somebody else meanwhile", target.string())};
  }
  if (exists && ::renameat2(AT_FDCWD, finished.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) {
    fs::remove_all(finished, code);  // that name now holds the old folder
    return {};
  }
  // File systems without an atomic exchange: the old folder steps aside and comes back if the rename fails.
  const fs::path aside = temporary_beside(target);
  if (exists) fs::rename(target, aside, code);
  if (!code) fs::rename(finished, target, code);
  if (code) {
    const Error error = os_error(target, "cannot be put in place", code.value());
    if (exists && !fs::exists(target, code)) fs::rename(aside, target, code);
    return error;
  }
  if (exists) fs::remove_all(aside, code);
  return {};
}

Status write_file(const fs::path& path, std::string_view content, Overwrite overwrite) {
  return write_file(path, source_of(content), overwrite);
}

namespace {

Status write_whole(const fs::path& path, const ByteSource& content, Overwrite overwrite, bool lasting) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status)) {
    return write_bytes(path, content, 0);
  }
  if (fs::is_directory(status)) {
    return Error{fmt::format("{}: found a folder, expected the name of a file", path.string())};
  }
  if (fs::exists(status) && overwrite == Overwrite::refuse) {
    return Error{
        fmt::format("{}: the file exists; choose another name or replace it with --force", path.string())};
  }
  const Result<fs::path> target = resolve(path);
  if (!target) return target.error();
  const fs::path temporary = temporary_beside(*target);
  Status written = write_bytes(temporary, content, O_CREAT | O_EXCL, lasting);
  if (written) {
    fs::rename(temporary, *target, code);
    if (code) written = os_error(*target, "cannot be put in place", code.value());
  }
  if (!written) fs::remove(temporary, code);
  if (written && lasting) written = sync_to_disk(target->parent_path());
  return written;
}

}  // namespace

Status write_file(const fs::path& path, const ByteSource& content, Overwrite overwrite) {
  return write_whole(path, content, overwrite, false);
}

Status write_lasting_file(const fs::path& path, const ByteSource& content) {
  return write_whole(path, content, Overwrite::replace, true);
}

Status sync_to_disk(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};  // that may not be read: the system writes it all the same, later
  const bool failed = sync_failed(::fsync(file));
  const int number = errno;
  ::close(file);
  return failed ? Status(os_error(path, "cannot be put on the disk", number)) : Status();
}

}  // namespace pade::io
