// Output that outlives a power cut: on the disk itself, and not only with the system, which writes it there
// when it likes. What waits for a disk costs time, so most output does not.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"

namespace pade::io {

/// As write_file() with Overwrite::replace; once it returns, the file is on the disk under its name. Before
/// that a power cut leaves what was there.
Status write_lasting_file(const std::filesystem::path& path, const ByteSource& content);

/// Waits until a file's bytes, or a folder's names, are on the disk. Errors: the disk does not take them.
Status sync_to_disk(const std::filesystem::path& path);

}  // namespace pade::io
