#include "pade/report/plot/gnuplot.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pade::evaluation {
namespace {

// A file without a name that is gone with its last user. Script and answers go through such files rather than
// pipes: no one waits for the other, and no signal comes where gnuplot ends early.
struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using TemporaryFile = std::unique_ptr<std::FILE, CloseFile>;

std::string content_of(std::FILE* file) {
  std::string content;
  std::rewind(file);
  std::array<char, 65536> part{};
  for (std::size_t got = 0; (got = std::fread(part.data(), 1, part.size(), file)) > 0;)
    content.append(part.data(), got);
  return content;
}

// Without the variables that change what gnuplot writes.
std::vector<char*> environment() {
  static std::string locale = "LC_ALL=C";
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    if (!text.starts_with("LC_ALL=") && !text.starts_with("GNU")) variables.push_back(*variable);
  }
  variables.push_back(locale.data());
  variables.push_back(nullptr);
  return variables;
}

// Starts gnuplot on the three files; its exit status, or the errno of why it did not start.
struct Outcome {
  int start_error = 0;
  int status = 0;
};

Outcome run(std::FILE* script, std::FILE* out, std::FILE* messages, std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fileno(script), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(out), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(messages), STDERR_FILENO);
  std::vector<char*> variables = environment();
  pid_t child = 0;
  Outcome outcome;
  outcome.start_error = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), variables.data());
  posix_spawn_file_actions_destroy(&actions);
  if (outcome.start_error != 0) return outcome;
  while (waitpid(child, &outcome.status, 0) < 0 && errno == EINTR) {
  }
  return outcome;
}

// The last line of what gnuplot said that is not empty: the reason; lines before it point into the script.
std::string reason_of(const std::string& messages) {
  const std::size_t end = messages.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return "it gave no reason";
  const std::size_t line = messages.find_last_of('\n', end);
  const std::size_t begin = messages.find_first_not_of(" \t", line == std::string::npos ? 0 : line + 1);
  return messages.substr(begin, end + 1 - begin);
}

}  // namespace

bool has_gnuplot() {
  const Result<std::string> answer = run_gnuplot("set print '-'\nprint 1\n");
  return answer.ok() && *answer == "1\n";
}

Result<std::string> run_gnuplot(std::string_view script) {
  const TemporaryFile in(std::tmpfile()), out(std::tmpfile()), messages(std::tmpfile());
  if (!in || !out || !messages || std::fwrite(script.data(), 1, script.size(), in.get()) != script.size() ||
      std::fflush(in.get()) != 0) {
    return Error{fmt::format("gnuplot: no temporary file for it: {}", std::strerror(errno))};
  }
  std::rewind(in.get());
  const Outcome outcome = run(in.get(), out.get(), messages.get(), {"gnuplot", "-d", "-"});
  if (outcome.start_error != 0) {
    return Error{fmt::format(
        "gnuplot: found no program of that name that could be started ({}), expected it on the PATH to draw "
        "plots; on Debian: apt-get install gnuplot-nox",
        std::strerror(outcome.start_error))};
  }
  if (WIFSIGNALED(outcome.status))
    return Error{fmt::format("gnuplot: ended by signal {}", WTERMSIG(outcome.status))};
  if (WEXITSTATUS(outcome.status) != 0) {
    return Error{fmt::format("gnuplot: exit status {}: {}", WEXITSTATUS(outcome.status),
                             reason_of(content_of(messages.get())))};
  }
  return content_of(out.get());
}

std::string gnuplot_string(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'')
      quoted += "’";  // '' is a quote inside a string, but not at its beginning
    else
      quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return quoted + "'";
}

}  // namespace pade::evaluation
