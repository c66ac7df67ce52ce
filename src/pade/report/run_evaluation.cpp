#include "pade/report/run_evaluation.hpp"

#include <map>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/text.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

namespace pade::evaluation {

Result<std::optional<DepthAccuracy>> stored_accuracy(const io::Run& run) {
  if (!run.has("evaluation.json")) return std::optional<DepthAccuracy>();
  const std::filesystem::path file = run.folder / "evaluation.json";
  const Result<std::string> text = io::read_file(file);
  if (!text) return text.error();
  Result<DepthAccuracy> accuracy = accuracy_from_json(*text, file.string());
  if (!accuracy) return accuracy.error();
  return std::optional(std::move(accuracy).value());
}

Result<DepthAccuracy> evaluate_stack(const io::Run& run, const io::Sequence& sequence,
                                     std::vector<io::Skipped>* skipped) {
  const auto refuse = [&run](const std::string& why) {
    return Error{fmt::format("{}: {}", run.folder.string(), why)};
  };
  if (run.depth_times.empty()) return refuse("found no depth images, expected a run made with --save depth");
  if (!sequence.has_truth())
    return refuse(fmt::format("found no true depth in {}", sequence.folder().string()));
  if (sequence.camera().size() != run.info.camera.size()) {
    return refuse(fmt::format("found images of {} x {} in {}, expected {} x {}", sequence.camera().width,
                              sequence.camera().height, sequence.folder().string(), run.info.camera.width,
                              run.info.camera.height));
  }
  std::map<Time, std::size_t> frame_at;
  for (std::size_t i = 0; i < sequence.size(); ++i) frame_at.emplace(sequence.time(i), i);

  Accumulator accumulator(run.info.range_limit);
  std::string first_reason;
  for (const Time time : run.depth_times) {
    if (io::interrupted()) return io::interrupted_error();
    const auto frame = frame_at.find(time);
    if (frame == frame_at.end()) {
      return refuse(fmt::format("found depth at {} s, when {} has no frame", to_string(time),
                                sequence.folder().string()));
    }
    const std::filesystem::path& file = sequence.depth_file(frame->second);
    if (file.empty()) continue;  // not every frame needs to have truth
    const Result<cv::Mat> truth = sequence.truth(frame->second);
    if (!truth) {
      io::Skipped bad = io::skipped_in(sequence.folder(), file.string(), truth.error().message);
      if (first_reason.empty()) first_reason = fmt::format("; first: {}: {}", bad.file, bad.reason);
      if (skipped != nullptr) skipped->push_back(std::move(bad));
      continue;
    }
    const Result<DepthImage> depth = io::read_depth_image(run, time);
    if (!depth) return depth.error();
    accumulator.add(*depth, *truth);
  }
  if (accumulator.empty())
    return refuse(fmt::format("found no frame with true depth that can be used in {}{}",
                              sequence.folder().string(), first_reason));
  return accumulator.result();
}

}  // namespace pade::evaluation
