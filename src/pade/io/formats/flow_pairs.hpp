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

/// The pairs of a folder, in order of their names:
/// - in itself and in its direct subfolders: one truth file (*.flo, or a PNG whose name begins with "flow")
/// and
///   images beside it, two of them or, where the truth is numbered (flow10.flo), those of this number and the
///   next;
/// - Middlebury: other-data/SCENE with the truth in other-gt-flow/SCENE;
/// - KITTI 2012 and 2015: image_2 (else image_0, colored_0) with the truth of flow_occ (else flow_noc);
/// - MPI Sintel: clean (else final) with the truth of flow.
/// `folder` may be the root of such a download, its training/, or other-data/.
/// @return at least one pair, or the error says what was looked for.
Result<std::vector<FlowPair>> find_flow_pairs(const std::filesystem::path& folder);

}  // namespace pade::io
