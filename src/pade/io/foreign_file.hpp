// What to do with recordings that are no folder of images and logs yet.
#pragma once

#include <filesystem>
#include <string>

namespace pade::io {

/// How to make a folder that is read of a log or a film, by the ending of its name: "; first extract ...".
/// Empty where nothing is known of the kind.
std::string advice_for(const std::filesystem::path& file);

/// The names of the files in a folder that end so, for messages: "; found a.csv, b.csv". Empty if there are
/// none.
std::string found_files(const std::filesystem::path& folder, const std::string& ending);

}  // namespace pade::io
