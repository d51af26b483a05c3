#include "daemon/service/daemon/token_access.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon::server {

using nlohmann::json;

Result<TokenOwner> TokenAccess::owner(std::string_view token, std::int64_t utc_us) {
  if (const auto entry = tokens_.find(token, utc_us))
    return TokenOwner{access::user_of(*entry), entry->role, *entry};
  return fail({.code = Errc::wrong_state,
               .where = "/params/token",
               .what = "token invalid or expired",
               .hint = "Create a token with weft token add"});
}

void TokenAccess::on_refused(std::string_view address, Clock now) {
  const runs::RepeatedStops::Stop refused{"token.refused", std::string(address), {}};
  if (refused_.is_journalled(refused, false, now)) journal_refused({{refused, now, 1}});
}

void TokenAccess::tick(Clock now) {
  using namespace std::chrono_literals;
  journal_refused(refused_.take(now));
  if (refreshed_ && now - *refreshed_ < 1s) return;
  refreshed_ = now;
  tokens_.refresh();
  const auto& problem = tokens_.problem();
  if (problem && !is_unreadable_)
    journal_("tokens.unreadable", json{{"error", to_string(*problem)}});
  is_unreadable_ = problem.has_value();
}

Status TokenAccess::reload() {
  tokens_.refresh();
  if (const auto& problem = tokens_.problem()) return tl::unexpected(*problem);
  return {};
}

void TokenAccess::journal_refused(const std::vector<runs::RepeatedStops::Counted>& counted) {
  for (const auto& [refused, since, times] : counted)
    journal_(refused.kind, json{{"address", refused.by}, {"count", times}});
}

}  // namespace weft::daemon::server
