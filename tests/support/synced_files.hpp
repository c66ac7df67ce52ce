// What a program puts on the disk itself: fdatasync() and fsync() under their own names. To be included by
// one source of a program.
#pragma once

#include <array>
#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pade::test {

/// A file or folder at the moment when it was put on the disk.
struct Synced {
  std::string path;
  std::size_t bytes = 0;           ///< of a file
  std::vector<std::string> names;  ///< in a folder
};

class SyncedFiles {
 public:
  static SyncedFiles& all() {
    static SyncedFiles the_files;
    return the_files;
  }
  std::vector<Synced> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(synced_, {});
  }
  void add(int file) {
    struct stat state {};
    if (::fstat(file, &state) != 0) return;
    std::array<char, 4096> name{};
    if (::readlink(fmt::format("/proc/self/fd/{}", file).c_str(), name.data(), name.size() - 1) < 0) return;
    Synced synced{name.data(), static_cast<std::size_t>(state.st_size), {}};
    std::error_code failed;
    if (S_ISDIR(state.st_mode)) {
      for (const auto& entry : std::filesystem::directory_iterator(synced.path, failed))
        synced.names.push_back(entry.path().filename().string());
    }
    const std::lock_guard lock(mutex_);
    synced_.push_back(std::move(synced));
  }

 private:
  std::mutex mutex_;
  std::vector<Synced> synced_;
};

}  // namespace pade::test

extern "C" {

inline int sync_as(const char* name, int file) {
  pade::test::SyncedFiles::all().add(file);
  return reinterpret_cast<int (*)(int)>(::dlsym(RTLD_NEXT, name))(file);
}
int fsync(int file) { return sync_as("fsync", file); }
int fdatasync(int file) { return sync_as("fdatasync", file); }
}
