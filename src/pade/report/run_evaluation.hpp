// The accuracy of a run on disk.
#pragma once

#include <optional>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/evaluation/depth_accuracy.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::evaluation {

/// What evaluation.json of the run says; empty if there is none.
Result<std::optional<DepthAccuracy>> stored_accuracy(const io::Run& run);

/// Compares the depth stack of a run with the true depth of its sequence, with the run's own range limit.
/// Equal to stored_accuracy() up to the half count that the 16-bit images round. Error if the run has no
/// depth stack, where the sequence has no truth or images of another size, or where a file of the run cannot
/// be read.
/// @param skipped  if given, gets the depth images of the sequence that cannot be used, with the reason
Result<DepthAccuracy> evaluate_stack(const io::Run& run, const io::Sequence& sequence,
                                     std::vector<io::Skipped>* skipped = nullptr);

}  // namespace pade::evaluation
