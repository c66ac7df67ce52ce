// Output that appears whole or not at all: written beside its place, renamed at the end, and removed on an
// error or on Ctrl-C.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"

namespace pade::io {

/// Takes the bytes of a file piece by piece, in order.
using ByteSink = std::function<void(std::string_view)>;
/// Gives the bytes of a file to a sink, so that a large one is never held whole.
using ByteSource = std::function<void(const ByteSink&)>;
/// All bytes of a source in one string.
std::string bytes_of(const ByteSource& source);

/// What to do if the output exists already.
enum class Overwrite {
  refuse,   ///< an error, before any work is done
  replace,  ///< the old output stays until the new one is complete
};

/// From now on SIGINT and SIGTERM set a flag instead of ending the process (a second signal ends it at once),
/// and SIGXFSZ is ignored, so that a file-size limit is a write error like any other. Called once by a
/// program, never by the library. Signals that were ignored at the start (nohup) stay ignored.
void watch_for_interrupts();
/// True after SIGINT or SIGTERM. Loops that take more than a moment poll it, leave, and let the destructors
/// clean up.
bool interrupted();
/// The error that a loop returns when it leaves because of interrupted().
Error interrupted_error();
/// The same if finished parts stay and the next run goes on from them.
Error interrupted_and_kept_error();

/// A folder that appears at its place with commit(), or never. Until then everything lies in a hidden folder
/// beside it; the destructor removes what was not committed.
class OutputFolder {
 public:
  /// Refuses an existing `target` (unless `overwrite` is replace and it is empty or holds a file `marker`, so
  /// that a slip of the keyboard never removes a folder of another kind), and a parent that cannot be written
  /// to. Missing parents are made.
  static Result<OutputFolder> create(const std::filesystem::path& target, Overwrite overwrite,
                                     std::string_view marker);

  /// @{
  /// What was moved from holds nothing and can only be assigned to or destroyed; what is assigned to discards
  /// its own uncommitted files.
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&& other) noexcept;
  /// @}
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  ~OutputFolder();

  /// Where the folder will be.
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }
  /// Where a file of the folder is to be written now; its sub-folder is made. For writers that take a path.
  Result<std::filesystem::path> place(const std::filesystem::path& relative) const;
  /// Writes a file of the folder; every byte is checked.
  Status write(const std::filesystem::path& relative, std::string_view content) const;
  /// @{
  /// The same for bytes, and for bytes piece by piece.
  Status write(const std::filesystem::path& relative, std::span<const unsigned char> content) const;
  Status write(const std::filesystem::path& relative, const ByteSource& content) const;
  /// @}

  /// Moves the folder to its place, replacing an old one in one step if the file system can.
  Status commit();

 private:
  OutputFolder() = default;
  void discard();

  std::filesystem::path target_;
  std::filesystem::path temporary_;        // empty once committed or moved from
  std::filesystem::path created_parents_;  // topmost parent that create() made; empty = none
  Overwrite overwrite_ = Overwrite::refuse;
};

/// Moves a finished folder to its place, in one step if the file system can, and removes what it replaces.
/// With Overwrite::refuse a place that was taken meanwhile is an error. Where it fails, both folders stay
/// where they were.
Status put_in_place(const std::filesystem::path& finished, const std::filesystem::path& target,
                    Overwrite overwrite);

/// Writes a single file beside its place and renames it. `path` may be a device such as /dev/stdout, which is
/// written to directly.
Status write_file(const std::filesystem::path& path, std::string_view content, Overwrite overwrite);
/// The same piece by piece.
Status write_file(const std::filesystem::path& path, const ByteSource& content, Overwrite overwrite);

}  // namespace pade::io
