// The `pade` command line: one file per subcommand, no algorithm inside.
#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "pade/core/version.hpp"

#include "commands.hpp"

namespace {

int run(int argc, char** argv) {
  CLI::App app("PADE: obstacle maps from one camera and a GPS/INS.", "pade");
  app.set_version_flag("--version", "pade " + std::string(pade::version));
  app.require_subcommand(1);
  pade::cli::Context context;
  pade::cli::add_map(app, context);
  pade::cli::add_evaluate(app, context);
  pade::cli::add_info(app, context);
  pade::cli::add_sample(app, context);
  pade::cli::add_flow(app, context);
  pade::cli::add_simulate(app, context);
  pade::cli::add_fly(app, context);
  pade::cli::add_navigate(app, context);
  pade::cli::add_calibrate(app, context);
  pade::cli::add_convert(app, context);
  pade::cli::add_live(app, context);
  pade::cli::add_plan(app, context);
  pade::cli::add_experiment(app, context);
  pade::cli::add_completion(app, context);
  CLI11_PARSE(app, argc, argv);
  return context.exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // Our own code throws nothing; the libraries below it do: no memory, a full /tmp.
  try {
    return run(argc, argv);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "pade: stopped by %s\n", failure.what());
  } catch (...) {
    std::fputs("pade: stopped by an unknown failure\n", stderr);
  }
  return 1;
}
