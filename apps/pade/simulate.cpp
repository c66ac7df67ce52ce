// `pade simulate`: flights through simulated worlds, written as sequences with exact truth.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pade/core/result.hpp"

#include "cache.hpp"
#include "commands.hpp"

#ifdef PADE_HAS_SIMULATION
#include "pade/io/atomic_output.hpp"
#include "pade/simulation/flight/simulated_sequence.hpp"
#include "pade/simulation/generator/open_world_scene.hpp"
#include "pade/simulation/generator/paper_set.hpp"
#include "pade/simulation/generator/paper_set_files.hpp"
#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

#include "options/unused_options.hpp"
#include "progress.hpp"
#endif

namespace pade::cli {
namespace {

struct SimulateArguments {
  std::string world;
  std::string flight;
  std::string out;
  std::string random;
  std::string write_world;
  std::string set;
  std::vector<std::string> resources;
  std::vector<std::string> save;
  std::uint64_t seed = 1;
  double density = 0;  // per hectare; 0 = a world with a lane
  int threads = 1;
  int samples = 4;
  int every = 1;
  bool preview = false;
  bool colour = false;
  bool quick = false;
  bool force = false;
  const CLI::App* command = nullptr;
};

#ifdef PADE_HAS_SIMULATION

namespace fs = std::filesystem;
using namespace pade::simulation;

SequenceOptions sequence_options(const SimulateArguments& arguments) {
  SequenceOptions options;
  options.seed = arguments.seed;
  if (arguments.preview) options.render = RenderOptions::preview();
  if (!arguments.preview) options.render.samples = arguments.samples;
  options.threads = arguments.threads;
  options.every = arguments.every;
  options.save_flow = std::find(arguments.save.begin(), arguments.save.end(), "flow") != arguments.save.end();
  options.overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  return options;
}

Result<Scene> load_scene(const fs::path& file, const SimulateArguments& arguments) {
  auto world = read_sdf(file, {arguments.resources.begin(), arguments.resources.end()});
  if (!world) return world.error();
  for (const std::string& warning : world->warnings)
    fmt::print(stderr, "pade simulate: warning: {}\n", warning);
  auto scene = Scene::build(std::move(world).value());
  if (!scene) return Error{fmt::format("{}: {}", file.string(), scene.error().message)};
  return scene;
}

Status render(const Scene& scene, Flight flight, const fs::path& out, const SimulateArguments& arguments,
              const SequenceOptions& options, const std::string& label) {
  if (arguments.colour) flight.image.colour = flight.states_colour = true;
  if (const auto inexact = precision_warning(flight))
    fmt::print(stderr, "pade simulate: warning: {}\n", *inexact);
  std::optional<Progress> line;
  int known = 0;
  return write_sequence(scene, flight, out, options, [&](int done, int total) {
    if (!line) line.emplace("Rendering " + label, static_cast<std::size_t>(total));
    for (; known < done; ++known) line->step();
  });
}

/// The flight that suits a generated world: the paper's through it.
Flight default_flight(WorldKind kind) {
  for (const PaperSequence& sequence : paper_sequences(1)) {
    if (sequence.world == kind && (kind != WorldKind::building || sequence.name == "approach"))
      return sequence.flight;
  }
  return {};
}

Status simulate_set(const SimulateArguments& arguments) {
  if (arguments.set != "paper") return Error{fmt::format("--set: found '{}', expected paper", arguments.set)};
  const fs::path folder =
      arguments.out.empty()
          ? default_cache() / fmt::format("paper-{}{}", arguments.seed, arguments.quick ? "-quick" : "")
          : fs::path(arguments.out);
  std::optional<Progress> line;
  std::string shown;
  int known = 0;
  const auto progress = [&](const std::string& label, int done, int total) {
    if (label != shown) {
      line.emplace("Rendering " + label, static_cast<std::size_t>(total));
      shown = label;
      known = 0;
    }
    for (; known < done; ++known) line->step();
  };
  const auto written =
      write_paper_set(folder, arguments.seed, arguments.quick, sequence_options(arguments), progress);
  if (!written) return written.error();
  fmt::print("{}\n", folder.string());
  return {};
}

/// Refuses what would do nothing.
Status check_use(const SimulateArguments& arguments) {
  const CLI::App& command = *arguments.command;
  const bool random = !arguments.random.empty();
  if (!arguments.world.empty() && (random || !arguments.set.empty())) {
    return Error{fmt::format("found the world {} and {}, expected one of them: it would do nothing",
                             arguments.world, random ? "--random" : "--set")};
  }
  if (!random && !arguments.write_world.empty())
    return Error{"--write-world: found it without --random, expected both: alone it would do nothing"};
  std::vector<std::string> used = {"--out",     "--seed", "--preview", "--every",
                                   "--threads", "--save", "--force",   "--samples"};
  if (arguments.preview) used.pop_back();
  const std::string beside = arguments.preview ? " and --preview" : "";
  if (!arguments.set.empty()) {
    for (const char* own : {"--set", "--quick"}) used.emplace_back(own);
    return refuse_unused(command, used, "--set" + beside);
  }
  if (random && arguments.out.empty() && !arguments.write_world.empty()) {
    return refuse_unused(command, {"--random", "--seed", "--density", "--write-world", "--force"},
                         "--write-world alone, without --out");
  }
  for (const char* own : {"--flight", "--colour"}) used.emplace_back(own);
  if (random) {
    for (const char* own : {"--random", "--density", "--write-world"}) used.emplace_back(own);
    return refuse_unused(command, used, "--random" + beside);
  }
  used.emplace_back("--resource-path");
  if (arguments.world.empty()) return {};
  return refuse_unused(command, used, "a world of a file" + beside);
}

fs::path cached_world(const SimulateArguments& arguments, const std::string& name) {
  return default_cache() / "worlds" / name / (arguments.random + ".sdf");
}

/// Where the user wants it, with meshes of its own beside it.
Status keep_world(const WorldFiles& files, const SimulateArguments& arguments) {
  const fs::path file = arguments.write_world;
  return write_world(with_own_meshes(files, file), file, sequence_options(arguments).overwrite);
}

/// A world without a lane: written and checked, then flown through if there is a flight.
Status simulate_open_world(const SimulateArguments& arguments) {
  const auto kind = from_name<OpenWorldKind>(arguments.random);
  if (!kind)
    return Error{
        fmt::format("--random: found '{}', with --density expected forest, rubble, building-site or street",
                    arguments.random)};
  if (arguments.write_world.empty() && (arguments.out.empty() || arguments.flight.empty()))
    return Error{"--density: found neither --write-world nor --flight with --out, expected one of them"};
  if (!arguments.out.empty() && arguments.flight.empty())
    return Error{"--flight: found nothing, expected a flight file (docs/simulator.md)"};
  // It is looked for in the cache: what the user named is written once, and only with a way through.
  const fs::path cached =
      cached_world(arguments, fmt::format("{}-{}-{}", arguments.random, arguments.seed, arguments.density));
  const auto made = make_open_world(*kind, arguments.seed, arguments.density, cached);
  if (!made) return made.error();
  if (!arguments.write_world.empty()) {
    const OpenWorld world = generate_open_world(*kind, arguments.seed, arguments.density, made->attempt);
    if (const Status s = keep_world(world.files, arguments); !s) return s;
  }
  fmt::print("{}: world {} of seed {}, from ({}, {}, {}) to ({}, {}, {}) m\n",
             arguments.write_world.empty() ? made->file.string() : arguments.write_world, made->attempt + 1,
             arguments.seed, made->start.x(), made->start.y(), made->start.z(), made->goal.x(),
             made->goal.y(), made->goal.z());
  if (arguments.out.empty()) return {};
  const auto flight = read_flight(arguments.flight);
  if (!flight) return flight.error();
  if (const Status s =
          render(made->scene, *flight, arguments.out, arguments, sequence_options(arguments), flight->name);
      !s)
    return s;
  fmt::print("{}\n", arguments.out);
  return {};
}

Status simulate(const SimulateArguments& arguments) {
  if (const Status useful = check_use(arguments); !useful) return useful;
  if (arguments.density > 0) return simulate_open_world(arguments);
  if (!arguments.set.empty()) return simulate_set(arguments);
  std::optional<WorldKind> kind;
  fs::path file = arguments.world;
  if (!arguments.random.empty()) {
    kind = from_name<WorldKind>(arguments.random);
    if (!kind)
      return Error{fmt::format("--random: found '{}', expected building, street, forest, rubble or corridor",
                               arguments.random)};
    const WorldFiles made = generate_world(*kind, arguments.seed);
    const bool keep = !arguments.write_world.empty();
    file = keep ? fs::path(arguments.write_world)
                : cached_world(arguments, fmt::format("{}-{}", arguments.random, arguments.seed));
    if (const Status s = keep ? keep_world(made, arguments) : write_world(made, file); !s) return s;
    if (keep && arguments.out.empty()) return {};
  }
  if (file.empty()) return Error{"no world: name an SDF file, --random KIND or --set paper"};
  if (arguments.out.empty()) return Error{"--out: found nothing, expected the folder of the new sequence"};
  if (arguments.flight.empty() && !kind)
    return Error{"--flight: found nothing, expected a flight file (docs/simulator.md)"};
  Flight flight;
  if (arguments.flight.empty()) {
    flight = default_flight(*kind);
  } else {
    auto read = read_flight(arguments.flight);
    if (!read) return read.error();
    flight = std::move(read).value();
  }
  const auto scene = load_scene(file, arguments);
  if (!scene) return scene.error();
  if (const Status s =
          render(*scene, flight, arguments.out, arguments, sequence_options(arguments), flight.name);
      !s)
    return s;
  fmt::print("{}\n", arguments.out);
  return {};
}

#else

Status simulate(const SimulateArguments&) {
  return Error{fmt::format("this build has no simulator: {}",
                           std::string_view(PADE_SIMULATION_MISSING).empty()
                               ? "it was configured with -DPADE_BUILD_SIMULATION=OFF"
                               : "missing were " PADE_SIMULATION_MISSING
                                 "; install them, then configure and build again")};
}

#endif

}  // namespace

void add_simulate(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand(
      "simulate", "Fly through a simulated world: images, exact depth and poses, IMU and GNSS");
  command->footer(
      "Examples:\n"
      "  pade simulate worlds/building/building.sdf --flight config/flights/building.yaml -o flight\n"
      "  pade simulate --random forest --seed 7 -o forest7\n"
      "  pade simulate --set paper --quick            the ten sequences of the experiments, a tenth of the "
      "frames\n"
      "A run that was cut short goes on where it stopped. docs/simulator.md: how to write worlds and "
      "flights.");
  auto arguments = std::make_shared<SimulateArguments>();
  arguments->command = command;
  command->add_option("world", arguments->world, "Gazebo world (SDF 1.0 to 1.9)");
  command->add_option("--flight", arguments->flight, "flight file (YAML)");
  command->add_option("--out,-o", arguments->out,
                      "folder of the new sequence; with --set: of all (default: the user's cache)");
  command->add_option("--random", arguments->random,
                      "make the world: building, street, forest, rubble or corridor");
  command->add_option("--seed", arguments->seed,
                      "changes the random world, the image noise and the sensors' errors");
  command
      ->add_option(
          "--density", arguments->density,
          "with --random forest, rubble, building-site or street: this many obstacles per hectare and no "
          "lane between start and goal, 60 m apart")
      ->check(CLI::Range(10.0, 2000.0));
  command->add_option(
      "--write-world", arguments->write_world,
      "write the random world to this SDF file, meshes of its name into meshes/ beside it (alone: without a "
      "flight)");
  command->add_option("--set", arguments->set, "paper: the ten sequences, 1038 frames, of the experiments");
  command->add_flag("--quick", arguments->quick, "with --set: a tenth of the frames");
  command->add_option("--resource-path", arguments->resources, "folders with models, meshes and images");
  command->add_option("--samples", arguments->samples, "samples per pixel")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  command->add_flag("--preview", arguments->preview, "one ray per pixel, no ambient occlusion");
  command->add_flag("--colour", arguments->colour, "colour images");
  command->add_option("--every", arguments->every, "only each n-th frame")->check(CLI::Range(1, 1000000));
  command
      ->add_option("--save", arguments->save,
                   "flow: exact flow and visibility to the next and the previous frame")
      ->delimiter(',')
      ->check(CLI::IsMember({"flow"}));
  command->add_option("--threads", arguments->threads, "the result is the same for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_flag("--force", arguments->force,
                    "replace an existing sequence, or a world that is there with another content");
  command->callback([arguments, &context] {
#ifdef PADE_HAS_SIMULATION
    io::watch_for_interrupts();
#endif
    if (const Status status = simulate(*arguments); !status) {
      fmt::print(stderr, "pade simulate: {}\n", status.error().message);
      context.exit_code = 1;
#ifdef PADE_HAS_SIMULATION
      if (io::interrupted()) context.exit_code = 130;
#endif
    }
  });
}

}  // namespace pade::cli
