#include "daemon/service/rpc/token_keeper.hpp"

#include <sys/stat.h>

#include <algorithm>

namespace weft::daemon::access {

TokenKeeper::Stamp TokenKeeper::read_stamp(const std::filesystem::path& file) {
  struct stat found {};
  if (lstat(file.c_str(), &found) != 0) return {};
  constexpr std::int64_t ns_per_s = 1'000'000'000;
  return {found.st_dev, found.st_ino, found.st_size,
          found.st_ctim.tv_sec * ns_per_s + found.st_ctim.tv_nsec};
}

Result<TokenKeeper> TokenKeeper::open(const std::filesystem::path& file) {
  const Stamp as_of = read_stamp(file);  // before it is read: a change meanwhile is seen later
  auto tokens = TokenFile::load(file);
  if (!tokens) return pass(tokens.error());
  return TokenKeeper(file, std::move(*tokens), as_of);
}

void TokenKeeper::refresh() {
  const Stamp now = read_stamp(file_);
  if (now == as_of_ && !problem_) return;
  auto tokens = TokenFile::load(file_);
  if (!tokens) {
    problem_ = tokens.error();
    return;
  }
  tokens_ = std::move(*tokens);
  as_of_ = now;
  problem_.reset();
}

std::optional<TokenEntry> TokenKeeper::find(std::string_view token, std::int64_t now_us) {
  refresh();
  return tokens_.find(token, now_us);
}

bool TokenKeeper::is_valid(const TokenEntry& entry, std::int64_t now_us) const {
  if (entry.expires_us <= now_us) return false;
  return std::ranges::find(tokens_.entries(), entry.sha256, &TokenEntry::sha256) !=
         tokens_.entries().end();
}

Status TokenKeeper::remove(std::string_view name) {
  const Status changed =
      TokenFile::change(file_, TokenFile::Wait::not_at_all,
                        [name](TokenFile& tokens) { return tokens.remove(name); });
  if (changed) refresh();
  return changed;
}

Result<std::string> TokenKeeper::add(std::string name, Role role, std::int64_t expires_us,
                                     std::string user, std::int64_t now_us) {
  std::string made;
  const Status changed =
      TokenFile::change(file_, TokenFile::Wait::not_at_all, [&](TokenFile& tokens) -> Status {
        tokens.forget_expired(now_us);
        auto token = tokens.add(std::move(name), role, expires_us, std::move(user));
        if (!token) return pass(token.error());
        made = std::move(*token);
        return {};
      });
  if (!changed) return pass(changed.error());
  refresh();
  return made;
}

}  // namespace weft::daemon::access
