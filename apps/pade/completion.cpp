// `pade completion SHELL`: a completion script for bash, zsh or fish, written from the command line's own
// description of itself, so that it never lags behind.
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "commands.hpp"

namespace pade::cli {
namespace {

struct Flag {
  std::vector<std::string> names;  // with their dashes
  std::string description;         // first sentence
  bool takes_value = false;
  bool list = false;                // values joined by commas
  std::vector<std::string> values;  // empty = a file name or anything
};

struct Command {
  std::vector<std::string> path;  // without "pade"; empty for the program itself
  std::string description;
  std::vector<Flag> flags;
  std::vector<Command> subcommands;
  std::vector<std::string> values;  // of the first positional
};

std::string first_sentence(const std::string& text) {
  return text.substr(0, std::min(text.find(". "), text.find('\n')));
}

// The choices that CLI::IsMember and its kin describe as {a,b} or {a->1,b->2}.
std::vector<std::string> choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto open = type.find('{');
  const auto close = type.find('}', open);
  std::vector<std::string> values;
  if (open == std::string::npos || close == std::string::npos) return values;
  for (const std::string& item : CLI::detail::split(type.substr(open + 1, close - open - 1), ',')) {
    values.push_back(item.substr(0, item.find("->")));
  }
  return values;
}

Flag describe(const CLI::Option& option) {
  Flag flag;
  for (const auto& name : option.get_lnames()) flag.names.push_back("--" + name);
  for (const auto& name : option.get_snames()) flag.names.push_back("-" + name);
  flag.description = first_sentence(option.get_description());
  flag.takes_value = option.get_items_expected_max() > 0;
  flag.list = option.get_delimiter() == ',';
  flag.values = choices(option);
  return flag;
}

Command describe(const CLI::App& app, std::vector<std::string> path) {
  Command command;
  command.description = first_sentence(app.get_description());
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    if (option->get_positional()) {
      if (command.values.empty()) command.values = choices(*option);
      continue;
    }
    command.flags.push_back(describe(*option));
  }
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (subcommand->get_group().empty()) continue;
    std::vector<std::string> below = path;
    below.push_back(subcommand->get_name());
    command.subcommands.push_back(describe(*subcommand, std::move(below)));
  }
  command.path = std::move(path);
  return command;
}

template <class Visitor>
void walk(const Command& command, const Visitor& visit) {
  visit(command);
  for (const Command& subcommand : command.subcommands) walk(subcommand, visit);
}

std::string join(const std::vector<std::string>& words, std::string_view separator = " ") {
  return fmt::format("{}", fmt::join(words, separator));
}

std::vector<std::string> names_of(const std::vector<Command>& commands) {
  std::vector<std::string> names;
  for (const Command& command : commands) names.push_back(command.path.back());
  return names;
}

std::string bash(const Command& program) {
  std::string find_command;
  std::string option_values;
  std::string words;
  walk(program, [&](const Command& command) {
    const std::string path = join(command.path);
    std::vector<std::string> flags;
    for (const Command& sub : command.subcommands) {
      find_command += fmt::format("      '{}:{}') command='{}' ;;\n", path, sub.path.back(), join(sub.path));
    }
    for (const Flag& flag : command.flags) {
      flags.insert(flags.end(), flag.names.begin(), flag.names.end());
      if (!flag.takes_value) continue;
      std::vector<std::string> patterns;
      for (const auto& name : flag.names) patterns.push_back(fmt::format("'{}:{}'", path, name));
      option_values += fmt::format("    {}) words='{}'; list={}; value=1 ;;\n", join(patterns, " | "),
                                   join(flag.values), flag.list ? "1" : "");
    }
    const std::string others =
        join(command.subcommands.empty() ? command.values : names_of(command.subcommands));
    words += fmt::format("      '{}') if [[ $cur == -* ]]; then words='{}'; else words='{}'; fi ;;\n", path,
                         join(flags), others);
  });
  // Without words (COMPREPLY empty) `-o default` completes file names.
  return fmt::format(R"(# bash completion for pade, written by `pade completion bash`
_pade() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} command='' words='' list='' value='' i
  # bash splits --option=value at the sign
  if [[ $cur == '=' ]]; then cur=''
  elif [[ $prev == '=' ]]; then prev=${{COMP_WORDS[COMP_CWORD - 2]}}; fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case $command:${{COMP_WORDS[i]}} in
{}    esac
  done
  case $command:$prev in
{}  esac
  if [[ ! $value ]]; then
    case $command in
{}    esac
  fi
  local before=''
  if [[ $list && $cur == *,* ]]; then before=${{cur%,*}},; fi
  mapfile -t COMPREPLY < <(compgen -P "$before" -W "$words" -- "${{cur#"$before"}}")
}}
complete -o bashdefault -o default -F _pade pade
)",
                     find_command, option_values, words);
}

// Text inside '...' and, for zsh, inside [...] and between colons.
std::string quoted(std::string_view text, std::string_view special) {
  std::string result;
  for (const char c : text) {
    if (c == '\'') {
      result += R"('\'')";
      continue;
    }
    if (special.find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

std::string zsh_function(const Command& command) {
  const std::string name = "_pade" + (command.path.empty() ? "" : "_" + join(command.path, "_"));
  std::string specs;
  for (const Flag& flag : command.flags) {
    const std::string text = quoted(flag.description, "[]:\\");
    std::string action = "_files";
    if (!flag.values.empty()) {
      action = flag.list ? "_values -s , value " + join(flag.values) : "(" + join(flag.values) + ")";
    }
    for (const auto& option : flag.names) {
      const bool is_long = option.starts_with("--");
      specs += flag.takes_value
                   ? fmt::format("    '{}{}[{}]:value:{}' \\\n", option, is_long ? "=" : "+", text, action)
                   : fmt::format("    '{}[{}]' \\\n", option, text);
    }
  }
  if (command.subcommands.empty()) {
    const std::string action = command.values.empty() ? "_files" : fmt::format("({})", join(command.values));
    return fmt::format("{}() {{\n  _arguments \\\n{}    '*:argument:{}'\n}}\n\n", name, specs, action);
  }
  std::string commands;
  std::string dispatch;
  for (const Command& sub : command.subcommands) {
    commands += fmt::format("    '{}:{}'\n", sub.path.back(), quoted(sub.description, ":\\"));
    dispatch += fmt::format("        {}) _pade_{} ;;\n", sub.path.back(), join(sub.path, "_"));
  }
  return fmt::format(R"({0}() {{
  local context state state_descr line
  typeset -A opt_args
  local -a commands=(
{1}  )
  _arguments -C \
{2}    '1:command:->command' \
    '*::argument:->argument'
  case $state in
    command) _describe command commands ;;
    argument)
      case $line[1] in
{3}      esac ;;
  esac
}}

)",
                     name, commands, specs, dispatch);
}

std::string zsh(const Command& program) {
  std::string script = "#compdef pade\n# zsh completion for pade, written by `pade completion zsh`\n\n";
  walk(program, [&](const Command& command) { script += zsh_function(command); });
  // Sourced it registers itself; found in $fpath it is the body of the function.
  return script + "if [ \"$funcstack[1]\" = _pade ]; then _pade \"$@\"; else compdef _pade pade; fi\n";
}

std::string fish(const Command& program) {
  std::string script = "# fish completion for pade, written by `pade completion fish`\n";
  walk(program, [&](const Command& command) {
    std::string here;
    for (const auto& word : command.path) here += fmt::format("__fish_seen_subcommand_from {}; and ", word);
    std::string none_below = "true";
    if (!command.subcommands.empty()) {
      none_below = "not __fish_seen_subcommand_from " + join(names_of(command.subcommands));
    }
    for (const Command& sub : command.subcommands) {
      script += fmt::format("complete -c pade -f -n '{}{}' -a {} -d '{}'\n", here, none_below,
                            sub.path.back(), quoted(sub.description, "\\"));
    }
    if (!command.values.empty()) {
      script +=
          fmt::format("complete -c pade -f -n '{}{}' -a '{}'\n", here, none_below, join(command.values));
    }
    for (const Flag& flag : command.flags) {
      std::string names;
      for (const auto& name : flag.names) {
        names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      const std::string values = flag.values.empty() ? "" : fmt::format(" -f -a '{}'", join(flag.values));
      script += fmt::format("complete -c pade -n '{}{}'{}{}{} -d '{}'\n", here, none_below, names,
                            flag.takes_value ? " -r" : "", values, quoted(flag.description, "\\"));
    }
  });
  return script;
}

}  // namespace

void add_completion(CLI::App& app, Context& /*context*/) {
  CLI::App* command = app.add_subcommand("completion",
                                         "Write a completion script for a shell. For example: "
                                         "source <(pade completion bash)");
  auto* shell =
      command->add_option("shell", "The shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->callback([&app, shell] {
    const Command program = describe(app, {});
    const auto name = shell->as<std::string>();
    const std::string script = name == "bash" ? bash(program) : name == "zsh" ? zsh(program) : fish(program);
    std::fwrite(script.data(), 1, script.size(), stdout);
  });
}

}  // namespace pade::cli
