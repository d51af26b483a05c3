#include "daemon/service/rpc/tokens.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "protocols/base/json_text.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::access {
namespace {

using nlohmann::json;

constexpr std::string_view prefix = "wft_";
constexpr std::array<std::string_view, 4> role_names{"observer", "operator", "engineer", "admin"};

Result<std::string> random_token() {
  std::array<std::uint8_t, 32> bits{};
  if (getrandom(bits.data(), bits.size(), 0) != static_cast<ssize_t>(bits.size()))
    return fail({.code = Errc::io,
                 .where = "token",
                 .what = "no random numbers available from the system"});
  Sha256Digest as_digest{};
  std::copy(bits.begin(), bits.end(), as_digest.begin());
  return std::string(prefix) + to_hex(as_digest);
}

Status check_private(const std::filesystem::path& file) {
  struct stat found {};
  if (lstat(file.c_str(), &found) != 0) return {};
  if (S_ISREG(found.st_mode) && (found.st_mode & 077) == 0) return {};
  return fail({.code = Errc::wrong_state,
               .where = file.string(),
               .what = "token file accessible to other users",
               .expected = "mode 0600",
               .hint = "Run chmod 600 " + file.string()});
}

constexpr const char* user_key = "acts_for";

Result<TokenEntry> parse_token_entry(const json& one) {
  const auto role = role_from(one.value("role", ""));
  if (!role || !one.contains("name") || !one.contains("sha256") || !one.contains("expires_us"))
    return fail({.code = Errc::parse,
                 .where = "tokens",
                 .what = "incomplete token entry",
                 .expected = "name, role, sha256 and expires_us"});
  return TokenEntry{one.at("name").get<std::string>(), *role, one.at("sha256").get<std::string>(),
                    one.at("expires_us").get<std::int64_t>(), one.value(user_key, "")};
}

json json_of(const TokenEntry& entry) {
  json out{{"name", entry.name},
           {"role", to_string(entry.role)},
           {"sha256", entry.sha256},
           {"expires_us", entry.expires_us}};
  if (!entry.user.empty()) out[user_key] = entry.user;
  return out;
}

/// The time depends on the lengths only.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

/// Held by at most one program; released when that program ends.
class TokenLock {
 public:
  static Result<TokenLock> take(const std::filesystem::path& file, TokenFile::Wait wait) {
    TokenLock lock(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (lock.descriptor_ < 0)
      return fail({.code = Errc::io,
                   .where = file.string(),
                   .what = "lock of the token file not created",
                   .got = std::generic_category().message(errno)});
    const int how = wait == TokenFile::Wait::not_at_all ? LOCK_EX | LOCK_NB : LOCK_EX;
    while (flock(lock.descriptor_, how) != 0) {
      if (errno == EINTR) continue;
      if (errno == EWOULDBLOCK)
        return fail({.code = Errc::wrong_state,
                     .where = file.string(),
                     .what = "token file in use by another program",
                     .hint = "Retry the request"});
      return fail({.code = Errc::io,
                   .where = file.string(),
                   .what = "token file not locked",
                   .got = std::generic_category().message(errno)});
    }
    return lock;
  }
  TokenLock(TokenLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  TokenLock& operator=(TokenLock&&) = delete;
  ~TokenLock() {
    if (descriptor_ >= 0) close(descriptor_);
  }

 private:
  explicit TokenLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

/// A person's name may have any letters. A name that starts like an option could not be passed to
/// weft token remove.
bool is_token_name(std::string_view name) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  return !name.empty() && name.size() <= 100 && !name.starts_with('-') && !name.starts_with('.') &&
         std::ranges::none_of(name, is_control);
}

}  // namespace

std::string_view to_string(Role role) {
  return role_names[static_cast<std::size_t>(role)];
}

std::optional<Role> role_from(std::string_view name) {
  const auto* const found = std::ranges::find(role_names, name);
  if (found == role_names.end()) return std::nullopt;
  return static_cast<Role>(found - role_names.begin());
}

Result<TokenFile> TokenFile::load(const std::filesystem::path& file) {
  TokenFile out;
  out.file_ = file;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return out;
  if (Status own = check_private(file); !own) return pass(own.error());
  const auto text = read_text_file(file);
  if (!text) return pass(text.error());
  const Result<json> parsed = parse_json(*text);
  if (!parsed) return pass(parsed.error(), file.string());
  const json& document = *parsed;
  if (!document.is_object() || !document.contains("tokens") || !document["tokens"].is_array())
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "invalid token file",
                 .expected = "{\"tokens\": [...]}"});
  try {
    for (const json& one : document["tokens"]) {
      auto entry = parse_token_entry(one);
      if (!entry) return pass(entry.error(), file.string());
      out.entries_.push_back(std::move(*entry));
    }
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "invalid token file",
                 .got = e.what()});
  }
  return out;
}

// The prefix "token:" distinguishes a token's owner from a user of the machine with the same name,
// in leases, keys and the journal.
std::string user_of(const TokenEntry& entry) {
  return entry.user.empty() ? "token:" + entry.name : entry.user;
}

Result<std::string> TokenFile::add(std::string name, Role role, std::int64_t expires_us,
                                   std::string user) {
  const bool taken = std::any_of(entries_.begin(), entries_.end(),
                                 [&](const TokenEntry& entry) { return entry.name == name; });
  if (taken)
    return fail({.code = Errc::invalid_argument,
                 .where = "token",
                 .what = "token name already in use",
                 .expected = "a new name",
                 .got = name,
                 .hint = "Remove the old token with weft token remove"});
  if (!is_token_name(name))
    return fail({.code = Errc::invalid_argument,
                 .where = "name",
                 .what = "invalid token name",
                 .expected = "1 to 100 bytes without control characters, not starting with - or .",
                 .got = recipes::clipped(name)});
  auto token = random_token();
  if (!token) return pass(token.error());
  entries_.push_back({std::move(name), role, sha256_hex(*token), expires_us, std::move(user)});
  return token;
}

void TokenFile::forget_expired(std::int64_t now_us) {
  std::erase_if(entries_, [&](const TokenEntry& entry) { return entry.expires_us <= now_us; });
}

Status TokenFile::remove(std::string_view name) {
  const auto gone =
      std::erase_if(entries_, [&](const TokenEntry& entry) { return entry.name == name; });
  if (gone > 0) return {};
  std::string known;
  for (const TokenEntry& entry : entries_) known += (known.empty() ? "" : ", ") + entry.name;
  return fail({.code = Errc::not_found,
               .where = "token",
               .what = "unknown token",
               .expected = known,
               .got = std::string(name)});
}

Status TokenFile::save() const {
  json list = json::array();
  for (const TokenEntry& entry : entries_) list.push_back(json_of(entry));
  return write_text_file(file_, json{{"tokens", std::move(list)}}.dump(2) + "\n", Readers::owner);
}

Status TokenFile::change(const std::filesystem::path& file, Wait wait,
                         const std::function<Status(TokenFile&)>& work) {
  const auto lock = TokenLock::take(file.string() + ".lock", wait);
  if (!lock) return pass(lock.error());
  auto tokens = load(file);
  if (!tokens) return pass(tokens.error());
  if (Status done = work(*tokens); !done) return done;
  return tokens->save();
}

std::optional<TokenEntry> TokenFile::find(std::string_view token, std::int64_t now_us) const {
  const std::string digest = sha256_hex(token);
  std::optional<TokenEntry> found;
  for (const TokenEntry& entry : entries_)
    if (equal_in_constant_time(entry.sha256, digest) && entry.expires_us > now_us) found = entry;
  return found;
}

TokenKeeper::Stamp TokenKeeper::read_stamp(const std::filesystem::path& file) {
  struct stat found {};
  if (lstat(file.c_str(), &found) != 0) return {};
  constexpr std::int64_t ns_per_s = 1'000'000'000;
  return {found.st_dev, found.st_ino, found.st_size,
          found.st_ctim.tv_sec * ns_per_s + found.st_ctim.tv_nsec};
}

Result<TokenKeeper> TokenKeeper::open(const std::filesystem::path& file) {
  const Stamp as_of = read_stamp(file);  // before loading: later changes are noticed
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
