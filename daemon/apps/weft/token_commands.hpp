#pragma once
// `weft token add | list | remove`: the tokens of a daemon's clients by TCP and HTTP, in its file.

#include <filesystem>
#include <string>

#include "daemon/apps/weft/console.hpp"
#include "protocols/base/result.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct TokenAddArgs {
  std::filesystem::path file;
  std::string name;
  std::string role = "operator";
  int days = 30;
};
struct TokenListArgs {
  std::filesystem::path file;
};
struct TokenRemoveArgs {
  std::filesystem::path file;
  std::string name;
};

void add_options(CLI::App& command, TokenAddArgs& args);
void add_options(CLI::App& command, TokenListArgs& args);
void add_options(CLI::App& command, TokenRemoveArgs& args);

/// Makes a token for TCP and prints it, once.
Result<int> run_token_add(const TokenAddArgs& args, Console& console);
/// Names, roles and until when each is good: the file knows no more of a token.
Result<int> run_token_list(const TokenListArgs& args, Console& console);
/// Takes one away; within a second or so it is good for nothing more.
Result<int> run_token_remove(const TokenRemoveArgs& args, Console& console);

}  // namespace weft::daemon::cli
