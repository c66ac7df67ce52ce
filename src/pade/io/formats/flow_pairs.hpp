// Finds image pairs with true flow in a folder, as the Middlebury and KITTI downloads lay them out.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::io {

/// Two images and the file with the true flow from the first to the second.
struct FlowPair {
  std::string name;  ///< the folder's name
  std::filesystem::path first;
  std::filesystem::path second;
  std::filesystem::path truth;
};

/// The pairs in `folder` itself and in its direct subfolders, in order of their names. A folder holds a pair
/// if it has one truth file (*.flo, or a PNG whose name begins with "flow") and exactly two other PNG, JPEG,
/// PGM or PPM images; the images' order is that of their names.
/// @return at least one pair, or the error says what was looked for.
Result<std::vector<FlowPair>> find_flow_pairs(const std::filesystem::path& folder);

}  // namespace pade::io
