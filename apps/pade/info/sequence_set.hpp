// `pade info` of a folder of sequences, and how hard their scenes are.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "pade/checks/scene_hardness.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::cli {

nlohmann::ordered_json json_of(const evaluation::SceneHardness& hardness);
void print_hardness(const evaluation::SceneHardness& hardness);

/// A folder among others, and the sequence in it or what is wrong with it.
struct FoundSequence {
  std::filesystem::path folder;
  Result<io::Sequence> sequence;
};

/// Folders below `path` that are sequences, whole or broken, by name.
std::vector<FoundSequence> sequences_in(const std::filesystem::path& path,
                                        const io::SequenceOptions& options);

/// Prints each with its scene, and all of them together.
Status inform_of_set(const std::string& path, const std::vector<FoundSequence>& sequences, bool as_json);

}  // namespace pade::cli
