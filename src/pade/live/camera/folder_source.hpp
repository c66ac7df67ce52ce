// A recorded sequence played as a camera would deliver it.
#pragma once

#include <filesystem>
#include <memory>

#include "pade/core/result.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// The images of a folder (docs/sequences.md; its poses are not used) at their real pace: the first comes at
/// once, its stamp is that moment of our clock. Frames that cannot be decoded are left out. Errors:
/// io::Sequence::open.
/// @param calibration  file instead of the folder's own; empty: its own
Result<std::unique_ptr<FrameSource>> open_folder(const std::filesystem::path& folder,
                                                 const std::filesystem::path& calibration);

/// Our monotonic clock.
Time now_of_ours();

}  // namespace pade::live
