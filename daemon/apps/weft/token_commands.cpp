#include "daemon/apps/weft/daemon_commands.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/table.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/service/rpc/tokens.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

CLI::Option* add_file(CLI::App& command, std::filesystem::path& file) {
  return command.add_option("--tokens", file, "the daemon's file of tokens")->required();
}

std::int64_t utc_us() {
  return utc_now().count() / 1000;
}

}  // namespace

void add_options(CLI::App& command, TokenAddArgs& args) {
  command.add_option("NAME", args.name, "whom it is for")->required();
  add_file(command, args.file);
  command.add_option("--role", args.role, "observer, operator, engineer or admin")
      ->check(CLI::IsMember({"observer", "operator", "engineer", "admin"}))
      ->capture_default_str();
  command.add_option("--days", args.days, "how long it is good for")
      ->check(CLI::Range(1, 3660))
      ->capture_default_str();
}
void add_options(CLI::App& command, TokenListArgs& args) {
  add_file(command, args.file)->check(CLI::ExistingFile);
}
void add_options(CLI::App& command, TokenRemoveArgs& args) {
  command.add_option("NAME", args.name, "whose it is")->required();
  add_file(command, args.file);
}

Result<int> run_token_add(const TokenAddArgs& args, Console& console) {
  constexpr std::int64_t day_us = 86'400'000'000;
  const std::int64_t expires_us = utc_us() + args.days * day_us;
  std::string made;
  const Status changed = access::TokenFile::change(
      args.file, access::TokenFile::Wait::until_free, [&](access::TokenFile& tokens) -> Status {
        auto token = tokens.add(args.name, *access::role_from(args.role), expires_us);
        if (!token) return pass(token.error());
        made = std::move(*token);
        return {};
      });
  if (!changed) return pass(changed.error());
  print(console, made + "\n",
        {{"token", made}, {"name", args.name}, {"role", args.role}, {"expires_us", expires_us}});
  return exit_ok;
}

Result<int> run_token_list(const TokenListArgs& args, Console& console) {
  const auto tokens = access::TokenFile::load(args.file);
  if (!tokens) return pass(tokens.error());
  Table table(Align::left);
  json list = json::array();
  for (const access::TokenEntry& entry : tokens->entries()) {
    const bool is_over = entry.expires_us <= utc_us();
    table.row({entry.name, std::string(to_string(entry.role)),
               (is_over ? "over since " : "until ") + utc_text(entry.expires_us)});
    list.push_back({{"name", entry.name},
                    {"role", to_string(entry.role)},
                    {"expires_us", entry.expires_us},
                    {"over", is_over}});
  }
  print(console, list.empty() ? "nobody has a token\n" : table.text(""), {{"tokens", list}});
  return exit_ok;
}

Result<int> run_token_remove(const TokenRemoveArgs& args, Console& console) {
  const Status changed = access::TokenFile::change(
      args.file, access::TokenFile::Wait::until_free,
      [&args](access::TokenFile& tokens) { return tokens.remove(args.name); });
  if (!changed) return pass(changed.error(), args.file.string());
  print(console, args.name + " has no token any more\n", {{"removed", args.name}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
