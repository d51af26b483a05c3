// `weft page`: the way from a shell at the bench to the daemon's page in a browser.

#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/daemon_call.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

constexpr int most_tries = 100;
constexpr std::string_view name_taken = "token.name_taken";

std::string own_name() {
  const passwd* const entry = getpwuid(getuid());
  return entry == nullptr ? "page" : entry->pw_name;
}

/// Names of tokens are taken once: "ada", "ada-2", ... A link for yourself acts for you, so that
/// page and terminal steer the same run; one for somebody else does not.
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

}  // namespace

void add_options(CLI::App& command, PageArgs& args) {
  add_socket(command, args);
  command.add_option(
      "--name", args.name,
      "whom it is for; left out, it has your name and, made through the Unix socket, is yours: "
      "the page and your terminal are one user");
  command.add_option("--role", args.role, "observer (who watches), operator, engineer or admin")
      ->check(CLI::IsMember({"observer", "operator", "engineer", "admin"}))
      ->capture_default_str();
  command.add_option("--days", args.days, "how long the link is good for")
      ->check(CLI::Range(1, 3660))
      ->capture_default_str();
}

Result<int> run_page(const PageArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto info = call(*daemon, "system.info");
  if (!info) return pass(info.error());
  const json url = info->value("http", json());
  if (!url.is_string())
    return fail({.code = Errc::wrong_state,
                 .where = "weftd",
                 .what = "this daemon serves no page",
                 .expected = "--http PORT",
                 .hint = "Start it with --http 8080"});
  const auto token = new_token(*daemon, args);
  if (!token) return pass(token.error());
  // After '#': a browser keeps it to itself, no server's log has it.
  const std::string link =
      url.get<std::string>() + "/#token=" + token->at("token").get<std::string>();
  print(console, link + "\n",
        {{"link", link}, {"name", token->at("name")}, {"expires_us", token->at("expires_us")}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
