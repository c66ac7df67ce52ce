// The `pade` command line: one file per subcommand, no algorithm inside.
#include <string>

#include <CLI/CLI.hpp>

#include "pade/core/version.hpp"

#include "commands.hpp"

int main(int argc, char** argv) {
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
  pade::cli::add_navigate(app, context);
  pade::cli::add_experiment(app, context);
  pade::cli::add_completion(app, context);
  CLI11_PARSE(app, argc, argv);
  return context.exit_code;
}
