// Runs gnuplot, which draws the plots: a separate program, needed only if there is something to plot.
#pragma once

#include <string>
#include <string_view>

#include "pade/core/result.hpp"

namespace pade::evaluation {

/// True if gnuplot can be run.
bool has_gnuplot();

/// What gnuplot writes to its standard output for `script`. It is started without a shell and without the
/// user's start-up files, and in the C locale, so that the same script gives the same bytes. Errors: gnuplot
/// is not installed (with the name of its Debian package), or it refused the script (with what it said).
Result<std::string> run_gnuplot(std::string_view script);

/// `text` as a string of a gnuplot script, in which nothing is substituted; control characters become spaces
/// and straight quotes curly ones.
std::string gnuplot_string(std::string_view text);

}  // namespace pade::evaluation
