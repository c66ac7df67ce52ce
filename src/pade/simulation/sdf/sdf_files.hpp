// Where the files that an SDF world names lie, and whether they may be loaded at all: libsdformat follows a
// cyclic include until the stack ends, and prints (but does not return) an error for a version that it does
// not know.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::simulation {

/// Folders in which model://NAME and relative names are looked for, in this order after the folder of the
/// file that names them.
using ResourcePaths = std::vector<std::filesystem::path>;

/// The file or folder that a URI (file://, model://, or a plain path) means; empty if there is none.
std::optional<std::filesystem::path> resolve_uri(const std::string& uri, const std::filesystem::path& base,
                                                 const ResourcePaths& resources);

/// The SDF file of a model folder (by model.config, else model.sdf), or the path itself if it is a file.
std::optional<std::filesystem::path> model_file(const std::filesystem::path& path);

/// Of each include, by its <uri>, the file or folder that it means.
using IncludedFiles = std::map<std::string, std::filesystem::path>;

/// Checks a file and all that it includes: it can be read, its version is 1.0 to 1.9 (of the file itself also
/// a later 1.x), included files exist, and none includes itself. libsdformat looks for an include by its name
/// alone, and first in the working directory: a name that means two things, or another one there, is refused.
Result<IncludedFiles> check_sdf_files(const std::filesystem::path& file, const ResourcePaths& resources);

/// What libsdformat is given in place of a file.
struct SeenText {
  std::string text;
  std::vector<std::string> left_out;  ///< what would have changed the picture, one sentence each
};

/// A file in words that libsdformat 12 takes, with the same lines: a later version as 1.9, and without what
/// cannot be seen (physics, collisions, plugins, user interfaces ...), which may be wrong in ways that do not
/// matter here.
/// @param file  its name in messages
SeenText without_unseen(std::string text, const std::string& file);

/// The version that a file states, if it is later than 1.9; else empty.
std::string later_version(const std::string& text);

}  // namespace pade::simulation
