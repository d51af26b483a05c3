#pragma once
// Output of a command: text or one JSON object on `out`, errors and progress on `err`; tables of
// text.

#include <exception>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// The exit status if the command line itself ends the program: 0 after help, version or manual, 2
/// after a usage error, with a sentence on standard error. nullopt: continue.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Exit status of a process.
inline constexpr int exit_ok = 0;
inline constexpr int exit_failure = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_promise_missed = 3;  ///< complete, but not within the requested accuracy
inline constexpr int exit_signal = 128;        ///< plus the number of the signal that asked to stop

struct Console {
  std::ostream& out;
  std::ostream& err;
  bool json = false;      ///< --json
  bool terminal = false;  ///< err is a terminal: a bar instead of lines
  std::istream* in =
      nullptr;        ///< standard input, for commands that take "-"; nullptr: there is none
  int keyboard = -1;  ///< descriptor of standard input if it is a terminal
};

/// Prints the outcome of a command in the requested form. Text ends with a newline. Control
/// characters other than tabs and line breaks become "?", as in report().
void print(Console& console, std::string_view text, const nlohmann::json& object);

/// Prints one of several results; with --json each on its own line.
void print_line(Console& console, std::string_view text, const nlohmann::json& object);

/// The parts of an error and its sentence.
nlohmann::json error_json(const Error& error);

/// One sentence on `err`; with --json also {"error": {...}} on `out`. Returns exit_failure.
int report(Console& console, const Error& error);
/// The same for an exception from `where` ("weft", "rank 3"). For std::bad_alloc: memory exhausted,
/// with advice.
int report_thrown(Console& console, const std::exception& thrown, const std::string& where);
/// The same for a usage error. Returns exit_usage.
int report_usage(Console& console, const std::string& message);

// Tables of text in columns, for terminals.

enum class Align { left, right };

/// Each column is as wide as its widest cell, with two blanks between columns. The first is
/// left-aligned; `others` aligns the others: right for numbers, left for facts. Rows may differ in
/// length.
class Table {
 public:
  explicit Table(Align others = Align::right) : others_(others) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// Every line starts with `indent`.
  [[nodiscard]] std::string text(const std::string& indent = "  ") const;

 private:
  Align others_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace weft::daemon::cli
