// Tokens of clients over TCP and HTTP: in the token file, and in a link to the page.

#include <pwd.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/service/rpc/tokens.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

const std::vector<std::string> all_roles{"observer", "operator", "engineer", "admin"};
constexpr int most_days = 3660;

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
struct PageArgs : SocketArgs {
  std::string name;  ///< empty: your system user name, or that with a number
  std::string role = "operator";
  int days = 1;
};

CLI::Option* add_file(CLI::App& command, std::filesystem::path& file) {
  return command.add_option("--tokens", file, "use this token file of the daemon")->required();
}

std::int64_t utc_us() {
  return utc_now().count() / 1000;
}

void add_options(CLI::App& command, TokenAddArgs& args) {
  command.add_option("NAME", args.name, "user of the token")->required();
  add_file(command, args.file);
  add_keyword(command, "--role", args.role, all_roles, "grant this role");
  add_count(command, "--days", args.days, 1, most_days, "expire after this number of days");
}
void add_options(CLI::App& command, TokenListArgs& args) {
  add_file(command, args.file)->check(CLI::ExistingFile);
}
void add_options(CLI::App& command, TokenRemoveArgs& args) {
  command.add_option("NAME", args.name, "user of the token")->required();
  add_file(command, args.file);
}

/// Makes a token for TCP and prints it, once.
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

/// Prints name, role and expiry of each token; the file has no other data.
Result<int> run_token_list(const TokenListArgs& args, Console& console) {
  const auto tokens = access::TokenFile::load(args.file);
  if (!tokens) return pass(tokens.error());
  Table table(Align::left);
  json list = json::array();
  for (const access::TokenEntry& entry : tokens->entries()) {
    const bool is_over = entry.expires_us <= utc_us();
    table.row({entry.name, std::string(to_string(entry.role)),
               (is_over ? "expired " : "expires ") + utc_text(entry.expires_us)});
    list.push_back({{"name", entry.name},
                    {"role", to_string(entry.role)},
                    {"expires_us", entry.expires_us},
                    {"over", is_over}});
  }
  print(console, list.empty() ? "there are no tokens\n" : table.text(""), {{"tokens", list}});
  return exit_ok;
}

/// Removes a token; it becomes invalid within about a second.
Result<int> run_token_remove(const TokenRemoveArgs& args, Console& console) {
  const Status changed = access::TokenFile::change(
      args.file, access::TokenFile::Wait::until_free,
      [&args](access::TokenFile& tokens) { return tokens.remove(args.name); });
  if (!changed) return pass(changed.error(), args.file.string());
  print(console, "removed the token of " + args.name + "\n", {{"removed", args.name}});
  return exit_ok;
}

constexpr int most_tries = 100;
constexpr std::string_view name_taken = "token.name_taken";

std::string own_name() {
  const passwd* const entry = getpwuid(getuid());
  return entry == nullptr ? "page" : entry->pw_name;
}

/// Each token name is used once: "ada", "ada-2", ... A link for yourself acts as you, so that page
/// and terminal control the same run; a link for another person does not.
Result<json> new_token(client::Client& daemon, const PageArgs& args) {
  const std::string name = args.name.empty() ? own_name() : args.name;
  const auto me = call(daemon, "session.whoami");
  if (!me) return pass(me.error());
  const bool own = args.name.empty() && me->at("local") == true;
  const json terms{{"role", args.role}, {"days", args.days}, {"own", own}};
  Result<json> made = json();
  for (int i = 1; i <= most_tries; ++i) {
    json params = terms;
    params["name"] = i == 1 ? name : name + "-" + std::to_string(i);
    made = call(daemon, "token.add", params);
    if (made || !args.name.empty() || daemon.refusal() != name_taken) break;
  }
  return made;
}

void add_options(CLI::App& command, PageArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("--name", args.name, "name the person this link is for (default: you)");
  add_keyword(command, "--role", args.role, all_roles, "grant this role");
  add_count(command, "--days", args.days, 1, most_days, "expire after this number of days");
}

/// Requests a token from the daemon, and prints the link that opens its page with it.
Result<int> run_page(client::Client& daemon, const PageArgs& args, Console& console) {
  const auto info = call(daemon, "system.info");
  if (!info) return pass(info.error());
  const json url = info->value("http", json());
  if (!url.is_string())
    return fail({.code = Errc::wrong_state,
                 .where = "weftd",
                 .what = "web page not enabled",
                 .expected = "--http PORT",
                 .hint = "Start weftd with --http 8080"});
  const auto token = new_token(daemon, args);
  if (!token) return pass(token.error());
  // After '#': the browser does not send it, so that no server logs it.
  const std::string link =
      url.get<std::string>() + "/#token=" + token->at("token").get<std::string>();
  print(console, link + "\n",
        {{"link", link}, {"name", token->at("name")}, {"expires_us", token->at("expires_us")}});
  return exit_ok;
}

}  // namespace

void add_page_command(const CommandGroup& weft) {
  add_daemon_command(weft, "page", run_page);
}

void add_token_commands(const CommandGroup& weft) {
  const CommandGroup token = weft.group("token");
  token.add<TokenAddArgs>("add", run_token_add);
  token.add<TokenListArgs>("list", run_token_list);
  token.add<TokenRemoveArgs>("remove", run_token_remove);
}

}  // namespace weft::daemon::cli
