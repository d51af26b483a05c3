#pragma once
// All commands of `weft` in one table. The help screens, the manual page, the completion and
// docs/reference/cli.md are made from it.

#include <span>
#include <string_view>

namespace weft::daemon::cli {

/// Commands for one kind of work.
struct CommandGroupSpec {
  std::string_view name;
  std::string_view purpose;
  std::string_view example;  ///< a whole command line
};

struct CommandSpec {
  std::string_view group;    ///< CommandGroupSpec::name, earlier_group, or empty
  std::string_view path;     ///< words behind `weft`: "dataset import"
  std::string_view summary;  ///< imperative phrase, under 80 characters
  std::string_view example;  ///< arguments; empty where others are in `path` or none are needed
};

/// Group of the commands that the next version removes.
inline constexpr std::string_view earlier_group = "Earlier";

/// In the order of the help screen.
std::span<const CommandGroupSpec> command_groups();
/// In the order of the help screen; a command precedes those below it.
std::span<const CommandSpec> command_specs();
/// The row of a path. A path without row is a broken contract.
const CommandSpec& command_spec(std::string_view path);

}  // namespace weft::daemon::cli
