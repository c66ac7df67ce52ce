// Where the program keeps what it can make again.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace pade::cli {

/// $XDG_CACHE_HOME/pade, else ~/.cache/pade.
inline std::filesystem::path default_cache() {
  namespace fs = std::filesystem;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return fs::path(cache) / "pade";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return fs::path(home) / ".cache" / "pade";
  return fs::path("pade-cache");
}

}  // namespace pade::cli
