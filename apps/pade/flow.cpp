// `pade flow`: optical flow between two images.
#include <cstdio>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/flow/flow_estimator.hpp"
#include "pade/io/formats/flow_file.hpp"
#include "pade/io/formats/flow_picture.hpp"
#include "pade/io/image/image_codec.hpp"

#include "commands.hpp"
#include "grey_image.hpp"

namespace pade::cli {
namespace {

struct FlowArguments {
  std::string first;
  std::string second;
  std::string method = "dis-medium";
  std::string out;
  std::string picture;
  double full_scale = 0;
  const CLI::Option* full_scale_given = nullptr;
};

void refuse(Context& context, const Error& error) {
  fmt::print(stderr, "pade flow: {}\n", error.message);
  context.exit_code = 1;
}

Status check_picture(const FlowArguments& arguments) {
  if (arguments.picture.empty() && arguments.full_scale_given->count() > 0)
    return Error{"--full-scale: found it without --picture, expected both: alone it would do nothing"};
  if (arguments.picture.empty()) return {};
  const Status name = io::check_image_name(arguments.picture);
  return name ? name
              : Status(Error{fmt::format("--picture {}: {}", arguments.picture, name.error().message)});
}

Status compute(const FlowArguments& arguments) {
  if (Status picture = check_picture(arguments); !picture) return picture;
  auto method = flow::make_flow_estimator(arguments.method);
  if (!method) return method.error();
  const auto first = read_grey(arguments.first);
  if (!first) return first.error();
  const auto second = read_grey(arguments.second);
  if (!second) return second.error();
  if (first->size() != second->size()) {
    return Error{fmt::format("{}: {} x {} pixels, expected {} x {} as in {}", arguments.second, second->cols,
                             second->rows, first->cols, first->rows, arguments.first)};
  }
  const FlowField field = (*method)->estimate(*first, *second);
  if (cv::Mat known = field.vectors.reshape(1) == field.vectors.reshape(1); cv::countNonZero(known) == 0) {
    return Error{fmt::format("{}: {} finds no flow in images of {} x {} pixels", arguments.first,
                             arguments.method, first->cols, first->rows)};
  }
  if (!arguments.out.empty()) {
    if (Status written = io::write_flow(arguments.out, field.vectors); !written) return written;
  }
  if (arguments.picture.empty()) return {};
  return io::save_image(arguments.picture, io::flow_picture(field.vectors, arguments.full_scale));
}

}  // namespace

void add_flow(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand("flow", "Optical flow between two images.");
  command->require_subcommand(0, 1);
  auto arguments = std::make_shared<FlowArguments>();
  command->add_option("first", arguments->first, "first image");
  command->add_option("second", arguments->second, "second image, of the same size");
  command->add_option("--flow", arguments->method, "method")
      ->check(CLI::IsMember(flow::flow_estimator_names()))
      ->capture_default_str();
  command->add_option("--out", arguments->out, "flow file to write: .flo, or .png in KITTI's 16-bit form");
  command->add_option("--picture", arguments->picture, "picture to write, in Middlebury's colours");
  arguments->full_scale_given = command->add_option("--full-scale", arguments->full_scale,
                                                    "vector length of full colour, pixels (0 = automatic)");

  add_flow_evaluate(*command, context);
  command->callback([arguments, command, &context] {
    if (!command->get_subcommands().empty()) return;
    if (arguments->first.empty() || arguments->second.empty()) {
      return refuse(context, Error{"two images are needed: pade flow FIRST SECOND"});
    }
    if (const Status done = compute(*arguments); !done) refuse(context, done.error());
  });
}

}  // namespace pade::cli
