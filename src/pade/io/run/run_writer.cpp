#include "pade/io/run/run_writer.hpp"

#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/io/formats/flow_file.hpp"
#include "pade/io/run/run_images.hpp"

namespace pade::io {

Result<ImageStacks> ImageStacks::parse(std::string_view names) {
  ImageStacks stacks;
  const std::array<std::pair<std::string_view, bool*>, 5> known = {{{"depth", &stacks.depth},
                                                                    {"sigma", &stacks.sigma},
                                                                    {"state", &stacks.state},
                                                                    {"bound", &stacks.bound},
                                                                    {"flow", &stacks.flow}}};
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find(','));
    names.remove_prefix(std::min(names.size(), name.size() + 1));
    bool found = false;
    for (const auto& [candidate, flag] : known) {
      if (candidate == name) found = *flag = true;
    }
    if (!found) {
      return Error{
          fmt::format("image stacks: found '{}', expected any of depth,sigma,state,bound,flow", name)};
    }
  }
  return stacks;
}

RunWriter::RunWriter(OutputFolder output, const RunWriterOptions& options)
    : output_(std::move(output)), options_(options), scale_(scale_for_range(options.range_limit)) {}

Result<RunWriter> RunWriter::create(const std::filesystem::path& folder, const RunWriterOptions& options) {
  Result<OutputFolder> output = OutputFolder::create(folder, options.overwrite, run_file);
  if (!output) return output.error();
  return RunWriter(std::move(output).value(), options);
}

Status RunWriter::add(const DepthImage& depth, const FlowField& flow) {
  for (int y = 0; y < depth.state.rows; ++y) {
    const auto* row = depth.state.ptr<std::uint8_t>(y);
    for (int x = 0; x < depth.state.cols; ++x) {
      if (row[x] < state_pixels_.size()) ++state_pixels_[row[x]];
    }
  }
  const ImageStacks& save = options_.save;
  const std::string file = to_string(depth.time) + ".png";
  if (save.bound && depth.bound.empty()) {
    return Error{
        fmt::format("image stacks: found no bound in the depth image of {} s, expected one; depth made with "
                    "these options "
                    "has none to save",
                    to_string(depth.time))};
  }
  if (save.depth || save.sigma || save.state || save.bound) {
    const DepthImage full = at_full_size(depth, options_.image_size);
    if (save.depth) {
      if (Status status = output_.write("depth/" + file, encode_metres(full.depth, scale_)); !status)
        return status;
    }
    if (save.sigma) {
      cv::Mat sigma;
      cv::sqrt(full.variance, sigma);
      if (Status status = output_.write("sigma/" + file, encode_metres(sigma, scale_)); !status)
        return status;
    }
    if (save.state) {
      if (Status status = output_.write("state/" + file, encode_image(full.state)); !status) return status;
    }
    if (save.bound) {
      if (Status status = output_.write("bound/" + file, encode_bounds(full.bound, scale_)); !status)
        return status;
    }
  }
  if (save.flow && !flow.empty()) return output_.write("flow/" + file, encode_kitti_flow(flow.vectors));
  return {};
}

void RunWriter::add_pose(Time time, const Pose& T_world_camera) {
  const Eigen::Vector3d& p = T_world_camera.translation;
  const Eigen::Quaterniond& q = T_world_camera.rotation;
  trajectory_ += fmt::format("{} {:.6f} {:.6f} {:.6f} {:.8f} {:.8f} {:.8f} {:.8f}\n", to_string(time), p.x(),
                             p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

RunInfo RunWriter::completed(RunInfo info) const {
  info.depth_scale = scale_;
  info.sigma_scale = scale_;
  info.bound_scale = scale_;
  info.range_limit = options_.range_limit;
  info.state_pixels = state_pixels_;
  info.stacks.clear();
  if (options_.save.depth) info.stacks.emplace_back("depth");
  if (options_.save.sigma) info.stacks.emplace_back("sigma");
  if (options_.save.state) info.stacks.emplace_back("state");
  if (options_.save.bound) info.stacks.emplace_back("bound");
  if (options_.save.flow) info.stacks.emplace_back("flow");
  return info;
}

Status RunWriter::finish(const RunInfo& info, const std::function<RunTiming()>& timing) {
  if (Status status = output_.write("trajectory.txt", trajectory_); !status) return status;
  if (Status status = output_.write(run_file, to_json(completed(info))); !status) return status;
  if (Status status = output_.write("timing.json", to_json(timing())); !status) return status;
  return output_.commit();
}

}  // namespace pade::io
