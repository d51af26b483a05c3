// The table of commands, and the texts made from it.

#include "daemon/apps/weft/command_specs.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace weft::daemon::cli {
namespace {

struct CommandLine {
  CommandLine() { add_commands(root, chosen); }
  CLI::App root{"all commands", "weft"};
  ChosenCommand chosen;
};

void collect_paths(const CLI::App& app, std::set<std::string>& paths) {
  for (const CLI::App* below : app.get_subcommands([](const CLI::App*) { return true; })) {
    paths.insert(command_path(*below));
    collect_paths(*below, paths);
  }
}

// Words of an example; one in double quotes may have blanks.
std::vector<std::string> words_of(std::string_view example) {
  const std::string text(example);
  const std::regex word(R"re("([^"]*)"|(\S+))re");
  std::vector<std::string> out;
  for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at)
    out.push_back((*at)[1].matched ? (*at)[1] : (*at)[2]);
  return out;
}

// The status and the output of `weft` with these words.
std::pair<int, std::string> run_weft(std::vector<const char*> words) {
  std::ostringstream out, err;
  Console console{.out = out, .err = err};
  words.insert(words.begin(), "weft");
  const int status = run(static_cast<int>(words.size()), words.data(), console);
  return {status, out.str() + err.str()};
}

TEST_CASE("the table has each command once and no other", "[command_specs]") {
  const CommandLine line;
  std::set<std::string> paths, rows;
  collect_paths(line.root, paths);
  for (const CommandSpec& spec : command_specs()) CHECK(rows.emplace(spec.path).second);
  CHECK(rows == paths);
}

TEST_CASE("each example is a command line that the parser accepts", "[command_specs]") {
  std::vector<std::string> examples;
  for (const CommandGroupSpec& group : command_groups()) {
    REQUIRE(group.example.starts_with("weft "));
    examples.emplace_back(group.example.substr(5));
  }
  for (const CommandSpec& spec : command_specs()) {
    CHECK(spec.summary.size() < 80);
    if (!spec.example.empty())
      examples.push_back(std::string(spec.path) + " " + std::string(spec.example));
  }
  // The files that options require to exist.
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "out/a");
  test::write_file(folder / "tokens.json", "{}");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder / "");
  for (const std::string& example : examples) {
    CommandLine line;
    std::vector<std::string> words = stop_arguments(words_of(example));
    std::ranges::reverse(words);
    INFO(example);
    CHECK_NOTHROW(line.root.parse(words));
    CHECK(line.chosen);
  }
  std::filesystem::current_path(before);
}

TEST_CASE("weft alone lists every command, stays within 96 columns and succeeds",
          "[command_specs]") {
  const auto [status, help] = run_weft({});
  CHECK(status == exit_ok);
  CHECK(run_weft({"--help"}) == std::pair(status, help));
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) CHECK(line.size() <= 96);
  for (const CommandSpec& spec : command_specs())
    if (spec.path.find(' ') == std::string_view::npos)
      CHECK(std::regex_search(help, std::regex("\\b" + std::string(spec.path) + "\\b")));
}

TEST_CASE("completion scripts are those of the shell named", "[command_specs]") {
  CHECK(run_weft({"completion"}).second.starts_with("# bash"));
  CHECK(run_weft({"completion", "bash"}) == run_weft({"completion"}));
  CHECK(run_weft({"completion", "zsh"}).second.starts_with("#compdef weft\n"));
  CHECK(run_weft({"completion", "fish"}).first == exit_usage);
}

}  // namespace
}  // namespace weft::daemon::cli
