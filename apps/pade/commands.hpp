// The subcommands of `pade`. Each lives in the file of its name, adds itself to the application, and sets the
// exit code when it is the one that was called: 0 done, 1 refused (the message is on standard error), 130
// interrupted.
#pragma once

#include <CLI/CLI.hpp>

namespace pade::cli {

struct Context {
  int exit_code = 0;
};

// Listed in the order of the help text. Add a declaration here and a call in main.cpp for a new subcommand.
void add_map(CLI::App& app, Context& context);
void add_evaluate(CLI::App& app, Context& context);
void add_info(CLI::App& app, Context& context);
void add_sample(CLI::App& app, Context& context);
void add_flow(CLI::App& app, Context& context);
void add_simulate(CLI::App& app, Context& context);
void add_fly(CLI::App& app, Context& context);
void add_navigate(CLI::App& app, Context& context);
void add_calibrate(CLI::App& app, Context& context);
void add_convert(CLI::App& app, Context& context);
void add_live(CLI::App& app, Context& context);
void add_plan(CLI::App& app, Context& context);
void add_flow_evaluate(CLI::App& flow, Context& context);  // of `pade flow`
void add_experiment(CLI::App& app, Context& context);
void add_completion(CLI::App& app, Context& context);  // last: it describes all the others

}  // namespace pade::cli
